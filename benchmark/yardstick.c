/* Copyright 2026 the poststall_sim developers
 * SPDX-License-Identifier: Apache-2.0
 *
 * Yardstick of the benchmarks: the velocity of a grid of vortex segments, with the arithmetic of
 * poststall_sim.aero.kernels.grid_velocity and its order of work. Not part of the product.
 *
 *     gcc -O3 -march=native -ffast-math -fPIC -shared -DREAL=double yardstick.c -lm
 *
 * Nodes row after row, each with the edge to the next node of its row (span) and to the node
 * below it in the next row (stream); core2 is the square of their core. Edges that do not exist
 * have no circulation, so that one loop over nodes needs no case for them.
 */
#include <math.h>
#include <tgmath.h>

enum { BLOCK = 512, WIDEST = 512 };

/* Velocity times 4 pi that `edges` nodes of a block add; `with_next` 0 leaves `stream` out. */
static void add_block(int edges, int width, int with_next, const REAL *restrict x,
                      const REAL *restrict y, const REAL *restrict z, const REAL *restrict r,
                      const REAL *restrict span, const REAL *restrict stream,
                      const REAL *restrict core2, REAL *sum)
{
    REAL u = 0, v = 0, w = 0;
    if (with_next) {
        for (int k = 0; k < edges; k++) {
            const int s = k + 1, t = k + width;
            const REAL rs = r[k] * r[s], rt = r[k] * r[t];
            const REAL es = rs + x[k] * x[s] + y[k] * y[s] + z[k] * z[s];
            const REAL et = rt + x[k] * x[t] + y[k] * y[t] + z[k] * z[t];
            const REAL ds = rs * ((es > 0 ? es : 0) + core2[k]);
            const REAL dt = rt * ((et > 0 ? et : 0) + core2[k]);
            const REAL inverse = 1 / (ds * dt);
            const REAL ks = span[k] * (r[k] + r[s]) * dt * inverse;
            const REAL kt = stream[k] * (r[k] + r[t]) * ds * inverse;
            const REAL a = ks * x[s] + kt * x[t];
            const REAL b = ks * y[s] + kt * y[t];
            const REAL c = ks * z[s] + kt * z[t];
            u += y[k] * c - z[k] * b;
            v += z[k] * a - x[k] * c;
            w += x[k] * b - y[k] * a;
        }
    } else {
        for (int k = 0; k < edges; k++) {
            const int s = k + 1;
            const REAL rs = r[k] * r[s];
            const REAL es = rs + x[k] * x[s] + y[k] * y[s] + z[k] * z[s];
            const REAL ks = span[k] * (r[k] + r[s]) / (rs * ((es > 0 ? es : 0) + core2[k]));
            u += ks * (y[k] * z[s] - z[k] * y[s]);
            v += ks * (z[k] * x[s] - x[k] * z[s]);
            w += ks * (x[k] * y[s] - y[k] * x[s]);
        }
    }
    sum[0] += u;
    sum[1] += v;
    sum[2] += w;
}

/* Arguments as of grid_velocity; arrays (6, total) of edges, points and out (n, 3). width at most
 * WIDEST. */
void grid(const REAL *arrays, int total, int width, int n, const REAL *points, REAL *out)
{
    const REAL *node_x = arrays, *node_y = node_x + total, *node_z = node_y + total;
    const REAL *span = node_z + total, *stream = span + total;
    const REAL *core2 = stream + total, factor = (REAL)(0.25 / M_PI);
    const int rows = total / width, block = BLOCK / width > 1 ? BLOCK / width : 1;
    REAL x[BLOCK + WIDEST], y[BLOCK + WIDEST], z[BLOCK + WIDEST], r[BLOCK + WIDEST];

    for (int p = 0; p < n; p++) {
        const REAL px = points[3 * p], py = points[3 * p + 1], pz = points[3 * p + 2];
        REAL sum[3] = {0, 0, 0};
        for (int row = 0; row < rows; row += block) {
            const int last = row + block >= rows, count = last ? rows - row : block;
            const int nodes = (last ? count : count + 1) * width, start = row * width;
            const int both = nodes - width;
            for (int k = 0; k < nodes; k++) {
                x[k] = px - node_x[start + k];
                y[k] = py - node_y[start + k];
                z[k] = pz - node_z[start + k];
                r[k] = sqrt(x[k] * x[k] + y[k] * y[k] + z[k] * z[k] + core2[start + k]);
            }
            add_block(both, width, 1, x, y, z, r, span + start, stream + start,
                      core2 + start, sum);
            if (last)
                add_block(width - 1, width, 0, x + both, y + both, z + both, r + both,
                          span + start + both, stream + start + both, core2 + start + both, sum);
        }
        for (int c = 0; c < 3; c++)
            out[3 * p + c] = factor * sum[c];
    }
}
