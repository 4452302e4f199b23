/* Checks of tests: a failed one is told, and the program ends with status 1. */
#ifndef CHECK_H
#define CHECK_H

#include <nearmiss.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(truth)                                                                       \
    do {                                                                                   \
        if (!(truth)) {                                                                    \
            fprintf(stderr, "%s:%d: expected %s (last error: %s)\n", __FILE__, __LINE__,   \
                    #truth, nearmiss_last_error());                                        \
            exit(1);                                                                       \
        }                                                                                  \
    } while (0)

#define OK(call) CHECK((call) == NEARMISS_STATUS_OK)

/* The call fails with this status, and its message contains these words. */
#define FAILS(call, status, words)                       \
    do {                                                 \
        CHECK((call) == (status));                       \
        CHECK(strstr(nearmiss_last_error(), (words)));   \
    } while (0)

/* A plate of 50 by 50 points, 1 by 1 wide, at z = 0. */
#define PLATE 2500
static inline void fill_plate(double *points) {
    for (int i = 0; i < PLATE; i++) {
        points[3 * i] = 0.02 * (i % 50);
        points[3 * i + 1] = 0.02 * (i / 50);
        points[3 * i + 2] = 0.0;
    }
}

#endif
