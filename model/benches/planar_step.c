/* The planar vehicle and RK4 as an engineer writes them in C, for the comparison in planar_step.rs.
 * REAL, SIN and COS are set on the compiler's command line: double, sin, cos or float, sinf, cosf.
 * Usage: planar_step STEPS; prints the nanoseconds taken and the final state. */
#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef REAL real;

typedef struct { real l, alpha, zeta, mu, nu, beta, sin_beta; } vehicle;

static void rate(const vehicle *v, const real x[4], real u, real out[4])
{
    const real al = v->alpha * v->l;
    const real m11 = 1 + v->mu + v->nu;
    const real m22 = al * v->l + v->nu;
    const real m12 = al * COS(v->beta - x[1]) + v->nu;
    const real torque = u - v->zeta * (x[2] + x[3]);
    const real f1 = torque - v->sin_beta - al * SIN(v->beta - x[1]) * x[3] * x[3];
    const real f2 = torque - al * SIN(x[1]);
    const real determinant = m11 * m22 - m12 * m12;
    out[0] = x[2];
    out[1] = x[3];
    out[2] = (m22 * f1 - m12 * f2) / determinant;
    out[3] = (m11 * f2 - m12 * f1) / determinant;
}

static void rk4(const vehicle *v, real x[4], real u, real h)
{
    real k1[4], k2[4], k3[4], k4[4], y[4];
    int i;
    rate(v, x, u, k1);
    for (i = 0; i < 4; i++) y[i] = x[i] + h / 2 * k1[i];
    rate(v, y, u, k2);
    for (i = 0; i < 4; i++) y[i] = x[i] + h / 2 * k2[i];
    rate(v, y, u, k3);
    for (i = 0; i < 4; i++) y[i] = x[i] + h * k3[i];
    rate(v, y, u, k4);
    for (i = 0; i < 4; i++) x[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
}

int main(int argc, char **argv)
{
    const long steps = argc > 1 ? atol(argv[1]) : 1000000;
    vehicle v = { (real)0.8, (real)0.9, (real)2.2, (real)0.066, (real)0, (real)0.0873, 0 };
    real x[4] = { 0, (real)0.12139, 0, 0 };
    struct timespec a, b;
    long i;
    v.sin_beta = SIN(v.beta);
    clock_gettime(CLOCK_MONOTONIC, &a);
    for (i = 0; i < steps; i++) rk4(&v, x, (real)4, (real)0.00625);
    clock_gettime(CLOCK_MONOTONIC, &b);
    printf("%lld %.17g %.17g %.17g %.17g\n",
           (long long)(b.tv_sec - a.tv_sec) * 1000000000LL + (b.tv_nsec - a.tv_nsec),
           (double)x[0], (double)x[1], (double)x[2], (double)x[3]);
    return 0;
}
