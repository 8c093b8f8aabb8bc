/* SPDX-License-Identifier: GPL-2.0-or-later
 * The same arm from C: who it is, a swing of two seconds, and a thousand starts at once. */
#include <lobatto/lobatto.h>
#include <stdio.h>

int main(int argc, char** argv) {
    lobatto_scene* scene = lobatto_scene_read(argc > 1 ? argv[1] : "arm.toml");
    if (lobatto_scene_status(scene) != 0) {
        fprintf(stderr, "%s\n", lobatto_scene_message(scene));
        return lobatto_scene_status(scene);
    }
    printf("%s\n", lobatto_scene_title(scene));
    for (size_t i = 0; i < lobatto_scene_parameters(scene); ++i)
        printf("  %s = %g %s\n", lobatto_scene_parameter_name(scene, i), lobatto_scene_parameter_value(scene, i),
               lobatto_scene_parameter_unit(scene, i));

    lobatto_settings settings = {0};
    settings.points = 6;
    lobatto_integrator* arm = lobatto_integrator_new(scene, &settings);
    if (lobatto_integrator_advance(arm, 100) != 0) fprintf(stderr, "%s\n", lobatto_integrator_message(arm));
    printf("t = %.2f s: a = %.6f, b = %.6f, H = %.9f\n", lobatto_integrator_t(arm), lobatto_integrator_q(arm)[0],
           lobatto_integrator_q(arm)[1], lobatto_integrator_energy(arm));

    double starts[1000];
    for (int i = 0; i < 1000; ++i) starts[i] = 0.001 * i;
    const char* const names[] = {"a"};
    const double* const columns[] = {starts};
    lobatto_sweep* sweep = lobatto_sweep_run(scene, &settings, 1000, 1, names, columns);
    int reached = 0;
    for (size_t i = 0; i < lobatto_sweep_count(sweep); ++i) reached += lobatto_sweep_statuses(sweep)[i] == 0;
    printf("%d of 1000 starts reached the end\n", reached);

    const int status = lobatto_sweep_status(sweep);
    lobatto_sweep_free(sweep);
    lobatto_integrator_free(arm);
    lobatto_scene_free(scene);
    return status;
}
