/* SPDX-License-Identifier: GPL-2.0-or-later
 * What a motion meets and what a step does, called from C99: events, multipliers, tangents, parameters, states that a
 * sweep keeps on the way. Its arguments: the scenes bouncing_ball, rod_pendulum and pendulum. */
#include <lobatto/lobatto.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void check(int holds, const char* claim) {
    if (holds) return;
    printf("failed: %s\n", claim);
    exit(1);
}

static void meet(const char* path) {
    lobatto_scene* scene = lobatto_scene_read(path);
    lobatto_settings settings = {0};
    settings.until = "1.5";
    lobatto_trajectory* run = lobatto_run(scene, &settings, 0);
    check(lobatto_trajectory_status(run) == 0, lobatto_trajectory_message(run));
    size_t met = 0, count = 0;
    const lobatto_event* const events = lobatto_trajectory_events(run, &met);
    check(met > 0 && fabs(events[0].q[0]) < 1e-12, "the ball is on the floor where it meets it");
    check(strcmp(lobatto_scene_event_text(scene, (size_t)events[0].kind), "floor: y = 0 falling") == 0, "its text");

    lobatto_integrator* ball = lobatto_integrator_new(scene, NULL);
    check(lobatto_integrator_advance_to(ball, 1.5) == 0, lobatto_integrator_message(ball));
    const lobatto_event* hits = NULL;
    check(lobatto_integrator_take_events(ball, &hits, &count) == 0 && count == met, "steps meet what a run meets");
    for (size_t i = 0; i < met; ++i)
        check(fabs(hits[i].t - events[i].t) < 1e-9 && hits[i].kind == events[i].kind, "at the same times");
    check(lobatto_integrator_take_events(ball, &hits, &count) == 0 && count == 0 && hits == NULL, "once");
    printf("met: %d\n", (int)met);
    lobatto_integrator_free(ball);
    lobatto_trajectory_free(run);
    lobatto_scene_free(scene);
}

static void hold(const char* path) {
    lobatto_scene* scene = lobatto_scene_read(path);
    lobatto_integrator* rod = lobatto_integrator_new(scene, NULL);
    const double* multipliers = NULL;
    size_t count = 0;
    check(lobatto_integrator_advance(rod, 10) == 0, lobatto_integrator_message(rod));
    check(lobatto_integrator_multipliers(rod, &multipliers, &count) == 0 && count == 1, "a rod, a multiplier");
    check(isfinite(multipliers[0]) && multipliers[0] != 0, "that pulls");
    lobatto_integrator_free(rod);
    lobatto_scene_free(scene);
}

static void turn(const char* path) {
    lobatto_scene* scene = lobatto_scene_read(path);
    lobatto_integrator* pendulum = lobatto_integrator_new(scene, NULL);
    double T[4], omega = 0;
    check(lobatto_integrator_tangent(pendulum, T) == 0, lobatto_integrator_message(pendulum));
    check(fabs(T[0] * T[3] - T[1] * T[2] - 1) < 1e-14, "a step keeps areas");
    double by_omega[2];
    check(lobatto_integrator_sensitivity(pendulum, "omega", by_omega) == 0, lobatto_integrator_message(pendulum));
    check(by_omega[1] < 0, "a stronger force from q = 1");
    const double* columns = NULL;
    size_t beside = 1;
    check(lobatto_integrator_columns(pendulum, &columns, &beside) == 0 && beside == 0, "nothing is eliminated");
    check(lobatto_integrator_column(pendulum, 0) == NULL, "so nothing has a name");
    check(lobatto_integrator_set(pendulum, "omega", 5) == 0, lobatto_integrator_message(pendulum));
    check(lobatto_integrator_parameter(pendulum, "omega", &omega) == 0 && omega == 5, "what was set");
    printf("unknown: status %d, ", lobatto_integrator_parameter(pendulum, "omga", &omega));
    printf("%s\n", lobatto_integrator_message(pendulum));
    lobatto_integrator_free(pendulum);

    /* With 3 points and long steps the error is large: the run warns. */
    lobatto_settings settings = {0};
    settings.points = 3;
    settings.step = "0.25";
    settings.until = "5";
    lobatto_trajectory* run = lobatto_run(scene, &settings, 1);
    check(lobatto_trajectory_warnings(run) == 1 && lobatto_trajectory_warning(run, 1) == NULL, "one warning");
    printf("warning: %s\n", lobatto_trajectory_warning(run, 0));
    lobatto_trajectory_free(run);

    lobatto_settings each = {0};
    each.until = "1";
    each.every = 8;
    const double starts[] = {0.5, 1};
    const char* const names[] = {"q"};
    const double* const values[] = {starts};
    lobatto_sweep* sweep = lobatto_sweep_run(scene, &each, 2, 1, names, values);
    check(lobatto_sweep_status(sweep) == 0, lobatto_sweep_message(sweep));
    const size_t* const first = lobatto_sweep_states_first(sweep);
    check(first[0] == 0 && first[1] == 4 && first[2] == 8, "of 20 steps: 0, 8, 16, 20");
    check(lobatto_sweep_states_q(sweep)[4] == 1 && lobatto_sweep_states_q(sweep)[7] == lobatto_sweep_q(sweep)[1],
          "start and end");
    check(lobatto_sweep_states_p(sweep)[7] == lobatto_sweep_p(sweep)[1], "its momentum");
    check(fabs(lobatto_sweep_states_t(sweep)[5] - 0.4) < 1e-15, "times");
    lobatto_sweep_free(sweep);
    each.every = 0;
    sweep = lobatto_sweep_run(scene, &each, 2, 1, names, values);
    check(lobatto_sweep_states_first(sweep) == NULL && lobatto_sweep_states_q(sweep) == NULL, "none were asked for");
    lobatto_sweep_free(sweep);
    const char* const twice[] = {"q", "q"};
    const double* const both[] = {starts, starts};
    sweep = lobatto_sweep_run(scene, &each, 2, 2, twice, both);
    check(lobatto_sweep_status(sweep) == 2, "one of two columns of a name would be lost");
    lobatto_sweep_free(sweep);
    lobatto_scene_free(scene);
}

int main(int argc, char** argv) {
    if (argc != 4) return 2;
    meet(argv[1]);
    hold(argv[2]);
    turn(argv[3]);
    return 0;
}
