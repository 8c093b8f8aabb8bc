/* SPDX-License-Identifier: MIT
 * The contract between the host and a compiled kernel: one C structure, fetched with lobatto_kernel_table().
 *
 * Conventions
 *   real      the kernel's number type, named by real_kind; every `void*` to numbers points to arrays of it.
 *   n         coordinates; s points of the quadrature; N = n (s - 2) interior unknowns (0 for a linear system).
 *   q, p      position and momentum, n each, in the units of the scene.
 *   u         momentum in velocity units, u = M^-1 p; the kernel's own state is (q, u).
 *   matrices  row-major.
 *   nodes     node-major: Q[i * n + k] is coordinate k at interior node i + 2, i = 0 ... s - 3 (the paper's q_xi,
 * q_{1-xi} for s = 4). Every function that can fail returns a lobatto_status and leaves the state of the last good step
 * untouched. No function allocates, locks, prints or keeps a pointer it was given.
 */
#ifndef LOBATTO_KERNEL_ABI_H
#define LOBATTO_KERNEL_ABI_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LOBATTO_ABI_VERSION 1u

typedef enum lobatto_status {
    LOBATTO_OK = 0,
    LOBATTO_NOT_CONVERGED = 1,     /* the stage equations were not solved within the iteration limit */
    LOBATTO_NOT_FINITE = 2,        /* a value overflowed or became not-a-number */
    LOBATTO_SINGULAR_JACOBIAN = 3, /* the Jacobian of the stage equations has no inverse */
    LOBATTO_SINGULAR_MASS = 4,     /* the mass matrix has no inverse for these parameters */
    LOBATTO_TIME_STANDS_STILL = 5  /* t + h equals t in this precision */
} lobatto_status;

typedef enum lobatto_real {
    LOBATTO_FLOAT = 0,
    LOBATTO_DOUBLE = 1,
    LOBATTO_LONG_DOUBLE = 2,
    LOBATTO_FLOAT128 = 3
} lobatto_real;

/* One call of `advance`: the step loop runs inside the kernel. */
typedef struct lobatto_advance {
    /* in */
    int64_t steps;        /* steps to take, >= 0 */
    int64_t record_every; /* write a record after each step whose index is a multiple of this; 0: no records */
    void* records;        /* room for the records: rows of 1 + 2n reals, t, q[n], p[n] */
    int64_t capacity;     /* rows that fit; when full, `advance` returns early with LOBATTO_OK */
    /* out */
    int64_t steps_done;       /* good steps of this call */
    int64_t records_written;  /* rows of this call */
    int64_t iterations;       /* Newton iterations of this call, in all */
    int32_t iterations_most;  /* and the most of one step */
    int32_t status;           /* the same value that `advance` returns */
    double increment_largest; /* largest last Newton increment of a good step, relative to the unknowns */
    double increment_failed;  /* the relative increment at which a failed step stopped */
} lobatto_advance;

typedef struct lobatto_kernel {
    uint32_t abi_version; /* LOBATTO_ABI_VERSION */
    uint32_t bytes;       /* sizeof(lobatto_kernel) */
    const char* name;     /* of the scene: a C identifier */
    const char* digest;   /* of the emitted text: 16 hexadecimal digits */
    int32_t real_kind;    /* lobatto_real */
    int32_t real_bytes;
    int32_t coordinates; /* n */
    int32_t parameters;  /* run-time parameters, in the order of the scene */
    int32_t points;      /* s */
    int32_t order;       /* of accuracy, in h */
    int32_t unknowns;    /* N; 0: no equations to solve (linear system, or s = 2) */
    int32_t linear;      /* 1: the step is an affine map, propagated without iteration */
    int32_t stepper_bytes;
    int32_t stepper_alignment;

    /* Life of a stepper: memory of stepper_bytes bytes that the caller owns, with this alignment. */
    int32_t (*prepare)(void* stepper, const void* parameters,
                       const void* step); /* values of stage parameter and step size */
    int32_t (*start)(void* stepper, const void* time, const void* q,
                     const void* p); /* forgets what earlier steps left */
    int32_t (*advance)(void* stepper, lobatto_advance* call);
    void (*state)(const void* stepper, void* time, void* q, void* p);

    /* Pieces, for tests and diagnostics. All after `prepare`; none changes the state. */
    void (*energy)(const void* stepper, const void* q, const void* p, void* energy);     /* H(q, p), 1 */
    void (*momentum)(const void* stepper, const void* q, const void* velocity, void* p); /* p = dL/dq', n */
    void (*velocity)(const void* stepper, const void* q, const void* p, void* velocity); /* its inverse, n */
    void (*acceleration)(const void* stepper, const void* q, void* W,
                         void* S); /* W = M^-1 grad V, n; S = M^-1 V'', n x n */
    void (*residual)(const void* stepper, const void* q, const void* p, const void* Q,
                     void* F);                                     /* stage equations at Q, N */
    void (*jacobian)(const void* stepper, const void* Q, void* J); /* dF/dQ, N x N */
    int32_t (*tangent)(const void* stepper, const void* q, const void* p, void* q1, void* p1,
                       void* T); /* one step from (q, p)
and its tangent map d(q1, p1)/d(q, p), 2n x 2n, rows and columns q then p */
} lobatto_kernel;

const lobatto_kernel* lobatto_kernel_table(void);

#ifdef __cplusplus
}
#endif

#endif
