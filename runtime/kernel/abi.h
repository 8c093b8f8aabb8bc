/* SPDX-License-Identifier: MIT
 * The contract between the host and a compiled kernel: one C structure, fetched with lobatto_kernel_table().
 *
 * Conventions
 *   real      the kernel's number type, named by real_kind; every `void*` to numbers points to arrays of it.
 *   n         coordinates; N unknowns of the equations that one step solves (0: none).
 *   q, p      position and momentum, n each, in the units of the scene. Every function of a state takes its time too.
 *   matrices  row-major.
 *   X         unknowns, node-major, N. Form separable: X[i * n + k] is coordinate k at interior node i + 2 (the paper's
 *             q_xi, q_{1-xi} for four points). Form general: X[j * n_a + a] is the active coordinate a at control point
 *             j + 1, the last of which is the end of the step, or a multiplier at control point j (n_a coordinates and
 *             the multipliers of the constraints together); then kappa of every cyclic coordinate.
 * Every function that can fail returns a lobatto_status and leaves the state of the last good step untouched. No
 * function locks, prints or keeps a pointer it was given. What looks for events allocates in each call, steps do not. A
 * stepper may keep its work arrays in its memory: do not use one from two threads, not even through `const void*`.
 */
#ifndef LOBATTO_KERNEL_ABI_H
#define LOBATTO_KERNEL_ABI_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LOBATTO_ABI_VERSION 14u

typedef enum lobatto_status {
    LOBATTO_OK = 0,
    LOBATTO_NOT_CONVERGED = 1,       /* the equations of the step, or of a velocity, were not solved */
    LOBATTO_NOT_FINITE = 2,          /* a value overflowed or became not-a-number */
    LOBATTO_SINGULAR_JACOBIAN = 3,   /* the Jacobian of the step's equations has no inverse */
    LOBATTO_SINGULAR_MASS = 4,       /* the mass matrix has no inverse for these parameters or at this state */
    LOBATTO_TIME_STANDS_STILL = 5,   /* t + h equals t in this precision */
    LOBATTO_UNSUPPORTED = 6,         /* the kernel was compiled without this */
    LOBATTO_OFF_CONSTRAINTS = 9,     /* a start does not keep the constraints, or is behind a wall; 7, 8 and 10 are what
                                        sweeps say of motions */
    LOBATTO_STOPPED = 11,            /* a stop was met: the last row of events says which, where and when */
    LOBATTO_IMPACTS_ACCUMULATE = 12, /* more impacts in one step than can be told apart, or a motion along a wall */
    LOBATTO_STATUSES = 13
} lobatto_status;

typedef enum lobatto_real {
    LOBATTO_FLOAT = 0,
    LOBATTO_DOUBLE = 1,
    LOBATTO_LONG_DOUBLE = 2,
    LOBATTO_FLOAT128 = 3,
    LOBATTO_DOUBLE_DOUBLE = 4, /* high, low: two doubles */
    LOBATTO_MANY_DIGITS = 5    /* as many as are asked for (base/many_digits.hpp) */
} lobatto_real;

typedef enum lobatto_form {
    LOBATTO_LINEAR_MAP = 0, /* the step is an affine map */
    LOBATTO_SEPARABLE = 1,  /* constant mass, forces without velocities: only interior nodes are implicit */
    LOBATTO_GENERAL = 2
} lobatto_form;

enum { LOBATTO_CUTS_OF_STEP = 100 }; /* at most; a step with more fails */

/* One call of `advance`: the step loop runs inside the kernel. */
typedef struct lobatto_advance {
    /* in */
    int64_t steps;        /* steps to take, >= 0 */
    int64_t record_every; /* write a record after each step whose index is a multiple of this; 0: no records */
    void* records;        /* room for the records: rows of 1 + 2n reals, t, q[n], p[n] */
    int64_t capacity;     /* rows that fit, at least dense + 1; when full, `advance` returns early with LOBATTO_OK */
    void* events; /* room for events: rows of 2 + 2n reals, event number, t, q[n], p[n]; null: none are sought */
    int64_t event_capacity; /* rows that fit, at least events_of_step; when fewer are left, `advance` returns early */
    double tolerance;       /* of increments, relative: where the iteration of a step may end; 0: rounding */
    int32_t dense;          /* rows between two steps before each record, equally spaced; needs record_every = 1 */
    /* Of kernels with a clock `steps` are arrivals at the times start + interval, start + 2 interval, ..., none beyond
     * `end`; on the way the chain takes steps of its own. Where `interval` is infinite, the only arrival is at `end`,
     * and events of the chain's last step are told beyond it too: no later call tells them. */
    double interval, end;
    int32_t chain_records; /* 1: the states of the chain are rows too */
    void* chain;           /* of kernels with a clock: room for a row, the chain's last state; null: it is not told */
    double* cuts;          /* room for the times at which walls and switches cut steps; null: they are not told */
    int64_t cut_capacity;  /* at least LOBATTO_CUTS_OF_STEP; when fewer are left, `advance` returns early */
    /* out */
    int32_t status;           /* the same value that `advance` returns */
    int64_t steps_done;       /* good steps of this call */
    int64_t chain_steps;      /* of kernels with a clock: steps of the chain, of this call */
    int64_t records_written;  /* rows of this call */
    int64_t events_written;   /* rows of this call */
    int64_t cuts_written;     /* of this call */
    int64_t iterations;       /* iterations of this call, in all */
    int32_t iterations_most;  /* and the most of one step */
    double increment_largest; /* largest last increment of a good step, relative to the unknowns */
    double increment_failed;  /* the relative increment at which a failed step stopped */
} lobatto_advance;

/* One call of `refilled_advance`. Arrays have an entry a lane. */
typedef struct lobatto_refilled_advance {
    /* in */
    int64_t steps;    /* steps to take at most, of each lane whose status is LOBATTO_OK */
    double tolerance; /* as of lobatto_advance */
    void* records;    /* room for rows of t, q[n], p[n] after each step, `capacity` a lane, at most so many steps */
    int64_t capacity; /* > 0 */
    void* events;     /* room for rows as of lobatto_advance, event_capacity a lane; null: none are sought */
    int64_t event_capacity; /* at least events_of_step */
    /* Of kernels with a clock, as of lobatto_advance: `steps` is the number of the arrival with which a lane ends, and
     * rows are of arrivals: of those whose number is a multiple of record_every (0: of none), of the one at the end,
     * and of the last before a failure. No events are sought. */
    int64_t record_every;
    double interval, end;
    /* in and out */
    int32_t* status; /* LOBATTO_STOPPED: the last row of events says where and why, and the step is not among those
                        done */
    /* out */
    int64_t *steps_done, *iterations, *events_written;
    int64_t *records_written, *chain_steps; /* with a clock (else each step has a row); the latter may be null */
} lobatto_refilled_advance;

typedef struct lobatto_kernel {
    uint32_t abi_version; /* LOBATTO_ABI_VERSION */
    uint32_t bytes;       /* sizeof(lobatto_kernel) */
    const char* name;     /* of the scene: a C identifier */
    const char* digest;   /* of the formulas: 16 hexadecimal digits */
    const char* method;   /* "Lobatto, 4 points" */
    int32_t real_kind;    /* lobatto_real */
    int32_t real_bytes;
    int32_t parts;          /* of a number, as the sum of so many doubles, the first of which is its rounded value */
    double epsilon;         /* of the number type: twice the largest relative error of rounding, or a bit more */
    int32_t form;           /* lobatto_form */
    int32_t coordinates;    /* n */
    int32_t parameters;     /* run-time parameters, in the order of the scene */
    int32_t inputs;         /* of these, which set_inputs may change */
    int32_t first_input;    /* they are one after another */
    int32_t nodes;          /* of the quadrature, both ends included where they are nodes */
    int32_t order;          /* of accuracy, in h */
    int32_t unknowns;       /* N; 0: no equations to solve */
    int32_t autonomous;     /* 1: no formula depends on time */
    int32_t clocked;        /* 1: steps are equally long in the time of a clock */
    int32_t linear;         /* 1: the equations of motion are linear */
    int32_t constraints;    /* phi(q, t) = 0 */
    int32_t has_energy;     /* 0: `energy` is unsupported */
    int32_t has_tangent;    /* 0: `tangent` is unsupported */
    int32_t has_dense;      /* 0: `dense` is unsupported, in `advance` too */
    int32_t events;         /* event functions: those of events, then of stops, then of walls */
    int32_t stops;          /* that end the motion; only where `advance` has room for events */
    int32_t impacts;        /* walls, which each step heeds */
    int32_t events_of_step; /* the most event rows of one step */
    int32_t stepper_bytes;
    int32_t stepper_alignment;

    /* Life of a stepper: memory of stepper_bytes bytes that the caller owns, with this alignment. */
    int32_t (*prepare)(void* stepper, const void* parameters,
                       const void* step); /* values of parameters and step size */
    int32_t (*start)(void* stepper, const void* time, const void* q,
                     const void* p); /* forgets what earlier steps left */
    /* The same, but what another stepper of this kernel, or this one, knows of events is kept: the motion goes on. */
    int32_t (*go_on)(void* stepper, const void* other, const void* time, const void* q, const void* p);
    int32_t (*advance)(void* stepper, lobatto_advance* call);
    void (*state)(const void* stepper, void* time, void* q, void* p);
    /* Between two steps: values of all parameters, of which those of inputs are taken; null without inputs. What it
     * refuses must be set again before the next step. */
    int32_t (*set_inputs)(void* stepper, const void* parameters);
    /* Position and velocity, each the sum of two numbers, q + q_rest; null without clean arithmetic. */
    void (*two_fold_state)(const void* stepper, void* q, void* q_rest, void* velocity, void* velocity_rest);
    /* Position and velocity at t + theta h inside the last step, on its polynomial. */
    int32_t (*dense)(const void* stepper, const void* theta, void* q, void* velocity);

    /* Numbers as sums of doubles, `parts` each, and back. */
    void (*to_parts)(const void* numbers, int64_t count, double* parts);
    void (*from_parts)(const double* parts, int64_t count, void* numbers);

    /* Pieces, for tests and diagnostics. All after `prepare`; none changes the state. */
    int32_t (*energy)(const void* stepper, const void* time, const void* q, const void* p,
                      void* energy); /* H(t, q, p), 1 */
    void (*momentum)(const void* stepper, const void* time, const void* q, const void* velocity,
                     void* p); /* p = dL/dq', n */
    int32_t (*velocity)(const void* stepper, const void* time, const void* q, const void* p,
                        void* velocity); /* its inverse, n */
    void (*slopes)(const void* stepper, const void* time, const void* q, const void* velocity, void* Lv,
                   void* Lq); /* dL/dq' and dL/dq + forces, n each */
    void (*constraint)(const void* stepper, const void* time, const void* q, void* phi, void* phi_t,
                       void* G); /* phi, dphi/dt at fixed q, and dphi/dq, constraints x n; null without constraints */
    int32_t (*multipliers)(const void* stepper, const void* time, const void* q, const void* p,
                           void* lambda); /* of a state, one a constraint */
    int32_t (*residual)(const void* stepper, const void* time, const void* q, const void* p, const void* X,
                        void* F); /* the step's equations at X, N */
    int32_t (*jacobian)(const void* stepper, const void* time, const void* q, const void* p, const void* X,
                        void* J); /* dF/dX, N x N */
    /* One step from (q, p) and its tangent map d(q1, p1)/d(q, p), 2n x 2n, rows and columns q then p. */
    int32_t (*tangent)(const void* stepper, const void* time, const void* q, const void* p, void* q1, void* p1,
                       void* T);

    /* Ensembles: `lanes` trajectories side by side, with one step size and one time. Memory of ensemble_bytes bytes
     * that the caller owns, with this alignment. All arrays are lane-major: lane l has parameters[l * parameters ...],
     * q[l * n ...], p[l * n ...]. status: one lobatto_status a lane, which each function sets; a lane whose status is
     * not LOBATTO_OK on entry of start or advance is left alone: where it has not started, its state means nothing.
     * No lane's results depend on its neighbours. */
    /* 0: none, and the functions are null. Else a stepper is what a lane falls back on: `advance` takes its steps by
     * Newton's iteration; dense, events, residual, jacobian and tangent are unsupported. */
    int32_t lanes;
    int32_t ensemble_bytes;
    int32_t ensemble_alignment;
    void (*ensemble_prepare)(void* ensemble, const void* parameters, const void* step, int32_t* status);
    void (*ensemble_start)(void* ensemble, const void* time, const void* q, const void* p, int32_t* status);
    /* steps_done and iterations: one a lane, of this call. A failed lane keeps its last good state. */
    void (*ensemble_advance)(void* ensemble, int64_t steps, double tolerance, int32_t* status, int64_t* steps_done,
                             int64_t* iterations);
    void (*ensemble_state)(const void* ensemble, void* q, void* p);
    void (*ensemble_energy)(const void* ensemble, void* energy); /* H, one a lane; null without energy */

    /* In a library for trajectories that end at times of their own or are looked at after every step, and with a clock,
     * instead of the five functions above: a lane takes a trajectory when the one before has ended. refilled_prepare is
     * the first call; a lane that was never filled has no status LOBATTO_OK. refilled_advance returns when a lane has
     * ended. */
    void (*refilled_prepare)(void* ensemble, const void* step);
    int32_t (*refilled_fill)(void* ensemble, int32_t lane, const void* parameters, const void* time, const void* q,
                             const void* p);
    void (*refilled_advance)(void* ensemble, lobatto_refilled_advance* call);
} lobatto_kernel;

const lobatto_kernel* lobatto_kernel_table(void);

/* Trajectories as lanes of a device (device_lanes.hpp). A lane is a row of words; word w of lane l is
 * words[w * room + l]. On the device the pointers are its own. */
typedef struct lobatto_device_call {
    uint64_t* words;
    int64_t room, lanes;           /* lanes that fit, and that there are */
    int64_t target;                /* steps since the start to reach, of each lane whose status is LOBATTO_OK */
    int64_t most;                  /* steps of a lane in this launch */
    int64_t* steps;                /* since the start, one a lane; in and out, as the others */
    int64_t* iterations;           /* since the start */
    int32_t* status;               /* LOBATTO_NOT_CONVERGED: `retake` takes the step; LOBATTO_STOPPED: looks at it */
    const int32_t* order;          /* lanes of this launch, `lanes` of them; null: all */
    int32_t alike;                 /* whether all lanes have the same parameters */
    int32_t watches;               /* whether events are sought, for stops or for what is kept */
    double start_time[2], step[2]; /* numbers of the kernel, in their first bytes */
} lobatto_device_call;

typedef struct lobatto_device_lanes {
    uint32_t abi_version;                   /* LOBATTO_ABI_VERSION */
    uint32_t bytes;                         /* sizeof(lobatto_device_lanes) */
    const char* digest;                     /* of the formulas */
    int32_t words;                          /* of a lane; 0: the kernel has none, and the functions are null */
    int32_t first_moving, moving;           /* of these, which steps change and `state` reads */
    int32_t shared_bytes, shared_alignment; /* of what all lanes of one step size share */
    int32_t host_bytes, host_alignment;     /* of room for the functions below, one a thread */
    int32_t columns;                        /* of `row` below; 0: nothing looks at the steps */
    int32_t kept;                           /* numbers that are kept of a trajectory */
    /* Lanes first, ..., last - 1 at their starts; arrays are lane-major, as of ensembles. */
    void (*place)(void* host, lobatto_device_call* call, int64_t first, int64_t last, const void* parameters,
                  const void* q, const void* p, double tolerance, void* energy);
    void (*shared)(const lobatto_device_call* call, int64_t lane,
                   void* shared); /* of any lane placed with LOBATTO_OK */
    /* Of each word whether it is a lane's own (1), not shared (0), where all have the same parameters. */
    void (*own)(const void* shared, uint8_t* is_own);
    /* What a launch does, on the host. */
    void (*advance)(lobatto_device_call* call, const void* shared, int64_t first, int64_t last);
    /* The first `count` lanes: from the step that failed to the target. Where steps are looked at that step alone, or a
     * look at it; rows, `columns` numbers each, of lanes that have ended: event number or -1, t, q, p, energy of its
     * last state, what is kept. */
    void (*retake)(void* host, lobatto_device_call* call, int64_t count, const void* parameters, double tolerance,
                   void* rows);
    void (*state)(void* host, const lobatto_device_call* call, int64_t first, int64_t last, void* q, void* p,
                  void* energy, void* kept); /* energy: one a lane; not a number without one */
} lobatto_device_lanes;

const lobatto_device_lanes* lobatto_device_lanes_table(void);

#ifdef __cplusplus
}
#endif

#endif
