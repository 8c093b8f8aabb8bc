/* SPDX-License-Identifier: GPL-2.0-or-later
 * Lobatto for C, and for languages that call C. lobatto.hpp is the same for C++ and says more of what each call means.
 *
 *     lobatto_scene *scene = lobatto_scene_read("pendulum.toml");
 *     lobatto_integrator *motion = lobatto_integrator_new(scene, NULL);
 *     if (lobatto_integrator_advance(motion, 100) != 0) puts(lobatto_integrator_message(motion));
 *
 * The examples further down go on from these lines; tests compile and run them.
 *
 * Handles are opaque. A function that makes one never returns NULL unless memory is out: what went wrong is its status,
 * and in words its message. A handle that failed may be asked for these two and be freed; what is asked of it else is
 * 0, NaN or NULL. NULL in place of a handle is answered in the same way: its own status is 4, and what is made of it
 * has status 2. Handles may be freed in any order. Strings and arrays belong to their handle, until it changes or is
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
    const char* clock;                /* "none": equal steps; "auto" */
    const char *step, *until;         /* formulas in the parameters */
    double every;                     /* keep every such state; with a clock, each such time */
    const char* const* set;           /* "name=formula" each; the last is NULL */
} lobatto_settings;

/* A crossing, a stop or an impact that was met. */
typedef struct lobatto_event {
    int kind; /* number of lobatto_scene_event_text */
    double t;
    const double *q, *p; /* n each */
} lobatto_event;

/* --- One trajectory, step by step -------------------------------------------------------------------------------- */

typedef struct lobatto_integrator lobatto_integrator;

/* Compiles the kernel of the scene, or finds it in the cache. The motion is at the scene's start.
 *
 *     while (lobatto_integrator_t(motion) < 10)
 *         if (lobatto_integrator_advance(motion, 1) != 0) break;
 *     printf("q = %g, %s\n", lobatto_integrator_q(motion)[0], lobatto_integrator_message(motion));
 *     lobatto_integrator_free(motion);
 */
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
/* The same with other values of all inputs. */
LOBATTO_C_API int lobatto_integrator_start_with_inputs(lobatto_integrator* integrator, double t, const double* q,
                                                       const double* p, const double* inputs);
LOBATTO_C_API int lobatto_integrator_advance(lobatto_integrator* integrator, int64_t steps);
LOBATTO_C_API int lobatto_integrator_advance_to(lobatto_integrator* integrator, double t);
LOBATTO_C_API int lobatto_integrator_set(lobatto_integrator* integrator, const char* parameter, double value);
/* All inputs of the scene, in its order: from the next step on, at the cost of a small part of a step. */
LOBATTO_C_API int lobatto_integrator_set_inputs(lobatto_integrator* integrator, const double* values);
LOBATTO_C_API int lobatto_integrator_velocity(lobatto_integrator* integrator, double* velocity); /* n */
/* Position and velocity at a time inside the last step, n each. */
LOBATTO_C_API int lobatto_integrator_at(lobatto_integrator* integrator, double t, double* q, double* velocity);
/* One step from here and its derivative: d(q1, p1)/d(q, p), 2n x 2n. The motion stays where it is. Not with a clock. */
LOBATTO_C_API int lobatto_integrator_tangent(lobatto_integrator* integrator, double* tangent);
/* d(q1, p1)/d(parameter or input) of the same step, 2n, by differences: about ten digits. */
LOBATTO_C_API int lobatto_integrator_sensitivity(lobatto_integrator* integrator, const char* parameter,
                                                 double* derivative);
LOBATTO_C_API int lobatto_integrator_parameter(lobatto_integrator* integrator, const char* parameter, double* value);
/* What was met since the last call: *count events, until the next call. */
LOBATTO_C_API int lobatto_integrator_take_events(lobatto_integrator* integrator, const lobatto_event** events,
                                                 size_t* count);
/* Of the constraints, here: *count numbers, until the next call. */
LOBATTO_C_API int lobatto_integrator_multipliers(lobatto_integrator* integrator, const double** multipliers,
                                                 size_t* count);
/* What follows from the coordinates, here: eliminated ones and their velocities, rotations and places of bodies. *count
 * numbers, until the next call; their names. */
LOBATTO_C_API int lobatto_integrator_columns(lobatto_integrator* integrator, const double** columns, size_t* count);
LOBATTO_C_API const char* lobatto_integrator_column(const lobatto_integrator* integrator, size_t index);

/* n: those of the scene. A clock adds the time as the last one where the energy changes; a start sets it, and its
 * momentum, whatever is given for them. */
LOBATTO_C_API size_t lobatto_integrator_coordinates(const lobatto_integrator* integrator);
LOBATTO_C_API double lobatto_integrator_step_size(const lobatto_integrator* integrator);
LOBATTO_C_API double lobatto_integrator_t(const lobatto_integrator* integrator);
LOBATTO_C_API const double* lobatto_integrator_q(const lobatto_integrator* integrator);
LOBATTO_C_API const double* lobatto_integrator_p(const lobatto_integrator* integrator);
/* Not a number where the scene leaves it out (energy = false) and the motion does not conserve it. */
LOBATTO_C_API double lobatto_integrator_energy(const lobatto_integrator* integrator);

/* --- Runs -------------------------------------------------------------------------------------------------------- */

typedef struct lobatto_trajectory lobatto_trajectory;

/* A run that fails on its way keeps what was computed. `measure`: whether its error is measured by a companion.
 *
 *     lobatto_settings settings = {0};
 *     settings.points = 6;
 *     settings.until = "3";
 *     lobatto_trajectory *run = lobatto_run(scene, &settings, 1);
 *     if (lobatto_trajectory_status(run) != 0) puts(lobatto_trajectory_message(run));
 *     printf("%d states, error %.1e\n", (int)lobatto_trajectory_count(run), lobatto_trajectory_error(run));
 *     lobatto_trajectory_free(run);
 */
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
/* Beside the state, count x *columns: multipliers and formulas of the scene, eliminated coordinates and their
 * velocities, the orientation and angular velocity of bodies. */
LOBATTO_C_API const double* lobatto_trajectory_columns(const lobatto_trajectory* trajectory, size_t* columns);
LOBATTO_C_API const char* lobatto_trajectory_column(const lobatto_trajectory* trajectory, size_t index); /* its name */
LOBATTO_C_API double lobatto_trajectory_error(const lobatto_trajectory* trajectory); /* relative, at the end; NaN */
LOBATTO_C_API const lobatto_event* lobatto_trajectory_events(const lobatto_trajectory* trajectory, size_t* count);
LOBATTO_C_API size_t lobatto_trajectory_warnings(const lobatto_trajectory* trajectory);
LOBATTO_C_API const char* lobatto_trajectory_warning(const lobatto_trajectory* trajectory, size_t index);

/* --- Sweeps ------------------------------------------------------------------------------------------------------ */

typedef struct lobatto_sweep lobatto_sweep;

/* `columns` arrays of `count` numbers; names[c] is a position q, a velocity q' or momentum p_q, or a parameter. Errors
 * are not measured.
 *
 *     const double q[] = {0.5, 1, 1.5}, omega[] = {6, 6, 7};
 *     const char *const names[] = {"q", "omega"};
 *     const double *const values[] = {q, omega};
 *     lobatto_sweep *sweep = lobatto_sweep_run(scene, NULL, 3, 2, names, values);
 *     for (size_t i = 0; i < lobatto_sweep_count(sweep); ++i) printf("q = %g\n", lobatto_sweep_q(sweep)[i]);
 *     lobatto_sweep_free(sweep);
 */
LOBATTO_C_API lobatto_sweep* lobatto_sweep_run(const lobatto_scene* scene, const lobatto_settings* settings,
                                               size_t count, size_t columns, const char* const* names,
                                               const double* const* values);
LOBATTO_C_API void lobatto_sweep_free(lobatto_sweep* sweep);
LOBATTO_C_API int lobatto_sweep_status(const lobatto_sweep* sweep); /* of the whole */
LOBATTO_C_API const char* lobatto_sweep_message(const lobatto_sweep* sweep);
LOBATTO_C_API size_t lobatto_sweep_count(const lobatto_sweep* sweep);
LOBATTO_C_API const int* lobatto_sweep_statuses(const lobatto_sweep* sweep); /* of each; 0: it reached the end */
LOBATTO_C_API const char* lobatto_sweep_status_text(const lobatto_sweep* sweep, int status);
LOBATTO_C_API size_t lobatto_sweep_warnings(const lobatto_sweep* sweep);
LOBATTO_C_API const char* lobatto_sweep_warning(const lobatto_sweep* sweep, size_t index);
LOBATTO_C_API const double* lobatto_sweep_t(const lobatto_sweep* sweep);
LOBATTO_C_API const double* lobatto_sweep_q(const lobatto_sweep* sweep);
LOBATTO_C_API const double* lobatto_sweep_p(const lobatto_sweep* sweep);
/* Where the settings say `every`: of trajectory i the start, each such state and the last one are rows first[i], ...,
 * first[i + 1] - 1 of these. Else NULL. */
LOBATTO_C_API const size_t* lobatto_sweep_states_first(const lobatto_sweep* sweep); /* count + 1 numbers */
LOBATTO_C_API const double* lobatto_sweep_states_t(const lobatto_sweep* sweep);
LOBATTO_C_API const double* lobatto_sweep_states_q(const lobatto_sweep* sweep);
LOBATTO_C_API const double* lobatto_sweep_states_p(const lobatto_sweep* sweep);

/* --- What is known of a scene ------------------------------------------------------------------------------------ */

typedef struct lobatto_text lobatto_text;

/* How its integrator follows: as a person reads it, as a LaTeX document, as JSON. */
LOBATTO_C_API lobatto_text* lobatto_derivation(const lobatto_scene* scene, const lobatto_settings* settings);
LOBATTO_C_API lobatto_text* lobatto_derivation_latex(const lobatto_scene* scene, const lobatto_settings* settings);
LOBATTO_C_API lobatto_text* lobatto_derivation_json(const lobatto_scene* scene, const lobatto_settings* settings);
/* What was found in it, and what its kernel leaves out.
 *
 *     lobatto_text *found = lobatto_check_json(scene, NULL);
 *     puts(lobatto_text_status(found) == 0 ? lobatto_text_content(found) : lobatto_text_message(found));
 *     lobatto_text_free(found);
 */
LOBATTO_C_API lobatto_text* lobatto_check_json(const lobatto_scene* scene, const lobatto_settings* settings);
/* Which steps keep linear motion bounded, and what this step does. */
LOBATTO_C_API lobatto_text* lobatto_stability_json(const lobatto_scene* scene, const lobatto_settings* settings);
/* Its integrator as C++: a header that needs nothing else, or as a textbook prints it. */
LOBATTO_C_API lobatto_text* lobatto_emit(const lobatto_scene* scene, const lobatto_settings* settings);
LOBATTO_C_API lobatto_text* lobatto_emit_plain(const lobatto_scene* scene, const lobatto_settings* settings);
LOBATTO_C_API void lobatto_text_free(lobatto_text* text);
LOBATTO_C_API int lobatto_text_status(const lobatto_text* text);
LOBATTO_C_API const char* lobatto_text_message(const lobatto_text* text);
LOBATTO_C_API const char* lobatto_text_content(const lobatto_text* text);
LOBATTO_C_API const char* lobatto_text_file(const lobatto_text* text); /* "arm.hpp"; NULL for what is no C++ */

/* --- Choosing ---------------------------------------------------------------------------------------------------- */

typedef struct lobatto_choice lobatto_choice;

/* The cheapest method and step that keep an error to the end, relative to the amplitude. The settings name no method
 * and no step. `budget`: seconds to search, at least 1.
 *
 *     lobatto_settings settings = {0};
 *     settings.until = "2";
 *     lobatto_choice *choice = lobatto_tune(scene, 1e-4, &settings, 10);
 *     if (lobatto_choice_status(choice) != 0) puts(lobatto_choice_message(choice));
 *     lobatto_integrator *chosen = lobatto_integrator_new(scene, lobatto_choice_settings(choice));
 *     lobatto_choice_free(choice);
 *     lobatto_integrator_free(chosen);
 */
LOBATTO_C_API lobatto_choice* lobatto_tune(const lobatto_scene* scene, double error, const lobatto_settings* settings,
                                           double budget);
LOBATTO_C_API void lobatto_choice_free(lobatto_choice* choice);
LOBATTO_C_API int lobatto_choice_status(const lobatto_choice* choice);
LOBATTO_C_API const char* lobatto_choice_message(const lobatto_choice* choice);
/* For lobatto_run and lobatto_integrator_new; for as long as the choice lives. */
LOBATTO_C_API const lobatto_settings* lobatto_choice_settings(const lobatto_choice* choice);
LOBATTO_C_API const char* lobatto_choice_method(const lobatto_choice* choice); /* "Lobatto, 8 points" */
LOBATTO_C_API double lobatto_choice_step(const lobatto_choice* choice);
LOBATTO_C_API double lobatto_choice_predicted_error(const lobatto_choice* choice);
LOBATTO_C_API double lobatto_choice_seconds(const lobatto_choice* choice); /* what the motion costs with it */
/* 1: no member of the family that was not tried can be expected to win. */
LOBATTO_C_API int lobatto_choice_complete(const lobatto_choice* choice);

/* --- Proving ----------------------------------------------------------------------------------------------------- */

typedef struct lobatto_proof lobatto_proof;

/* Everything that can be checked of a scene: claims, and whether each holds. Status 0 says that all were looked at.
 *
 *     lobatto_proof *proof = lobatto_verify(scene, NULL);
 *     for (size_t i = 0; i < lobatto_proof_count(proof); ++i)
 *         if (!lobatto_proof_holds(proof, i)) puts(lobatto_proof_claim(proof, i));
 *     lobatto_proof_free(proof);
 */
LOBATTO_C_API lobatto_proof* lobatto_verify(const lobatto_scene* scene, const lobatto_settings* settings);
LOBATTO_C_API void lobatto_proof_free(lobatto_proof* proof);
LOBATTO_C_API int lobatto_proof_status(const lobatto_proof* proof);
LOBATTO_C_API const char* lobatto_proof_message(const lobatto_proof* proof);
LOBATTO_C_API size_t lobatto_proof_count(const lobatto_proof* proof);
LOBATTO_C_API int lobatto_proof_holds(const lobatto_proof* proof, size_t index); /* 1: it does */
LOBATTO_C_API const char* lobatto_proof_claim(const lobatto_proof* proof, size_t index);
LOBATTO_C_API const char* lobatto_proof_measured(const lobatto_proof* proof, size_t index);
LOBATTO_C_API const char* lobatto_proof_bound(const lobatto_proof* proof, size_t index);
LOBATTO_C_API const char* lobatto_proof_meaning(const lobatto_proof* proof, size_t index); /* of a failure */

#ifdef __cplusplus
}
#endif

#endif
