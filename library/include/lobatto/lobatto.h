/* SPDX-License-Identifier: GPL-2.0-or-later
 * Lobatto for C, and for languages that call C. lobatto.hpp is the same for C++ and says more of what each call means.
 *
 *     lobatto_scene *scene = lobatto_scene_read("pendulum.toml");
 *     lobatto_integrator *motion = lobatto_integrator_new(scene, NULL);
 *     if (lobatto_integrator_advance(motion, 100) != 0) puts(lobatto_integrator_message(motion));
 *
 * Handles are opaque. A function that makes one never returns NULL unless memory is out: what went wrong is its status,
 * and in words its message. A handle that failed may be asked for these two and be freed; what is asked of it else is
 * 0 or NULL. Handles may be freed in any order. Strings and arrays belong to their handle, until it changes or is
 * freed. One handle must not be used by two threads at a time. No exception leaves these functions.
 *
 * Status: 0 all is well; 1 a stop of the scene ended the motion; 2 wrong input; 3 the computation failed; 4 the
 * compiler or the machine failed. 2 to 4 are the exit codes of the command line.
 *
 * Units are those of the scene; arrays of states are row-major, count x n.
 */
#ifndef LOBATTO_H
#define LOBATTO_H

#include <stddef.h>
#include <stdint.h>

#ifdef __GNUC__
#define LOBATTO_C_API __attribute__((visibility("default")))
#else
#define LOBATTO_C_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

LOBATTO_C_API const char* lobatto_version(void);

/* --- Scenes ------------------------------------------------------------------------------------------------------ */

typedef struct lobatto_scene lobatto_scene;

LOBATTO_C_API lobatto_scene* lobatto_scene_read(const char* path);
/* The text of a scene file; `path` stands in messages. */
LOBATTO_C_API lobatto_scene* lobatto_scene_from_text(const char* text, const char* path);
LOBATTO_C_API void lobatto_scene_free(lobatto_scene* scene);
LOBATTO_C_API int lobatto_scene_status(const lobatto_scene* scene);
LOBATTO_C_API const char* lobatto_scene_message(const lobatto_scene* scene);

LOBATTO_C_API const char* lobatto_scene_name(const lobatto_scene* scene);
LOBATTO_C_API const char* lobatto_scene_title(const lobatto_scene* scene);
LOBATTO_C_API size_t lobatto_scene_coordinates(const lobatto_scene* scene); /* n */
LOBATTO_C_API const char* lobatto_scene_coordinate_name(const lobatto_scene* scene, size_t index);
LOBATTO_C_API const char* lobatto_scene_coordinate_unit(const lobatto_scene* scene, size_t index);
LOBATTO_C_API size_t lobatto_scene_parameters(const lobatto_scene* scene);
LOBATTO_C_API const char* lobatto_scene_parameter_name(const lobatto_scene* scene, size_t index);
LOBATTO_C_API const char* lobatto_scene_parameter_unit(const lobatto_scene* scene, size_t index);
LOBATTO_C_API double lobatto_scene_parameter_value(const lobatto_scene* scene, size_t index);
LOBATTO_C_API size_t lobatto_scene_inputs(const lobatto_scene* scene); /* they are parameters too */
LOBATTO_C_API const char* lobatto_scene_input_name(const lobatto_scene* scene, size_t index);
LOBATTO_C_API size_t lobatto_scene_events(const lobatto_scene* scene);
LOBATTO_C_API const char* lobatto_scene_event_text(const lobatto_scene* scene, size_t index);

/* What stands in for the scene's own; zeros and NULLs are as the scene has it: lobatto_settings settings = {0}. */
typedef struct lobatto_settings {
    int points, stages, splitting;    /* of Lobatto, Gauss, a splitting method; one at most */
    double tolerance;                 /* of the iteration of a step, relative */
    const char *arithmetic, *numbers; /* "plain", "clean"; "double", "float", ... */
    const char *step, *until;         /* formulas in the parameters */
    int64_t every;                    /* keep every such state */
    const char* const* set;           /* "name=formula" each; the last is NULL */
} lobatto_settings;

/* --- One trajectory, step by step -------------------------------------------------------------------------------- */

typedef struct lobatto_integrator lobatto_integrator;

/* Compiles the kernel of the scene, or finds it in the cache. The motion is at the scene's start. */
LOBATTO_C_API lobatto_integrator* lobatto_integrator_new(const lobatto_scene* scene, const lobatto_settings* settings);
/* A second motion from where this one is. */
LOBATTO_C_API lobatto_integrator* lobatto_integrator_copy(const lobatto_integrator* integrator);
LOBATTO_C_API void lobatto_integrator_free(lobatto_integrator* integrator);
LOBATTO_C_API int lobatto_integrator_status(const lobatto_integrator* integrator); /* of the last call */
LOBATTO_C_API const char* lobatto_integrator_message(const lobatto_integrator* integrator);

/* These return the status. A step that fails leaves the motion where it was. */
LOBATTO_C_API int lobatto_integrator_start(lobatto_integrator* integrator, double t, const double* q, const double* p);
LOBATTO_C_API int lobatto_integrator_start_from_velocity(lobatto_integrator* integrator, double t, const double* q,
                                                         const double* velocity);
LOBATTO_C_API int lobatto_integrator_advance(lobatto_integrator* integrator, int64_t steps);
LOBATTO_C_API int lobatto_integrator_advance_to(lobatto_integrator* integrator, double t);
LOBATTO_C_API int lobatto_integrator_set(lobatto_integrator* integrator, const char* parameter, double value);
/* All inputs of the scene, in its order: from the next step on, at the cost of a small part of a step. */
LOBATTO_C_API int lobatto_integrator_set_inputs(lobatto_integrator* integrator, const double* values);
LOBATTO_C_API int lobatto_integrator_velocity(lobatto_integrator* integrator, double* velocity); /* n */
/* Position and velocity at a time inside the last step, n each. */
LOBATTO_C_API int lobatto_integrator_at(lobatto_integrator* integrator, double t, double* q, double* velocity);

LOBATTO_C_API size_t lobatto_integrator_coordinates(const lobatto_integrator* integrator);
LOBATTO_C_API double lobatto_integrator_step_size(const lobatto_integrator* integrator);
LOBATTO_C_API double lobatto_integrator_t(const lobatto_integrator* integrator);
LOBATTO_C_API const double* lobatto_integrator_q(const lobatto_integrator* integrator);
LOBATTO_C_API const double* lobatto_integrator_p(const lobatto_integrator* integrator);
LOBATTO_C_API double lobatto_integrator_energy(const lobatto_integrator* integrator);

/* --- Runs -------------------------------------------------------------------------------------------------------- */

typedef struct lobatto_trajectory lobatto_trajectory;

/* A run that fails on its way keeps what was computed. `measure`: whether its error is measured by a companion. */
LOBATTO_C_API lobatto_trajectory* lobatto_run(const lobatto_scene* scene, const lobatto_settings* settings,
                                              int measure);
LOBATTO_C_API void lobatto_trajectory_free(lobatto_trajectory* trajectory);
LOBATTO_C_API int lobatto_trajectory_status(const lobatto_trajectory* trajectory);
LOBATTO_C_API const char* lobatto_trajectory_message(const lobatto_trajectory* trajectory);
LOBATTO_C_API size_t lobatto_trajectory_count(const lobatto_trajectory* trajectory);
LOBATTO_C_API const double* lobatto_trajectory_t(const lobatto_trajectory* trajectory);
LOBATTO_C_API const double* lobatto_trajectory_q(const lobatto_trajectory* trajectory);
LOBATTO_C_API const double* lobatto_trajectory_p(const lobatto_trajectory* trajectory);
LOBATTO_C_API const double* lobatto_trajectory_energy(const lobatto_trajectory* trajectory); /* NULL: none is kept */
LOBATTO_C_API double lobatto_trajectory_error(const lobatto_trajectory* trajectory); /* relative, at the end; NaN */

/* --- Sweeps ------------------------------------------------------------------------------------------------------ */

typedef struct lobatto_sweep lobatto_sweep;

/* `columns` arrays of `count` numbers; names[c] is a position q, a velocity q' or momentum p_q, or a parameter. */
LOBATTO_C_API lobatto_sweep* lobatto_sweep_run(const lobatto_scene* scene, const lobatto_settings* settings,
                                               size_t count, size_t columns, const char* const* names,
                                               const double* const* values);
LOBATTO_C_API void lobatto_sweep_free(lobatto_sweep* sweep);
LOBATTO_C_API int lobatto_sweep_status(const lobatto_sweep* sweep); /* of the whole */
LOBATTO_C_API const char* lobatto_sweep_message(const lobatto_sweep* sweep);
LOBATTO_C_API size_t lobatto_sweep_count(const lobatto_sweep* sweep);
LOBATTO_C_API const int* lobatto_sweep_statuses(const lobatto_sweep* sweep); /* of each; 0: it reached the end */
LOBATTO_C_API const char* lobatto_sweep_status_text(const lobatto_sweep* sweep, int status);
LOBATTO_C_API const double* lobatto_sweep_t(const lobatto_sweep* sweep);
LOBATTO_C_API const double* lobatto_sweep_q(const lobatto_sweep* sweep);
LOBATTO_C_API const double* lobatto_sweep_p(const lobatto_sweep* sweep);

#ifdef __cplusplus
}
#endif

#endif
