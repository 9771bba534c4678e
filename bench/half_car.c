/* SPDX-License-Identifier: Apache-2.0 */
/* The half car of pneumo_ros.plant (equations, integrator) in plain C: same equations, same branches, same RK4.
 * The limit that bench/kernel.py measures the compiled Python against. */
#include <math.h>
#include <string.h>

#define R_AIR 287.05
#define GRAVITY 9.81

typedef struct {
    double sprung_mass, pitch_inertia, front_arm, rear_arm, unsprung_front, unsprung_rear, tyre_front, tyre_rear,
        damping_front, damping_rear, area_scale_front, area_scale_rear, stop_height, stop_stiffness;
} body_t;

typedef struct {
    double exponent, k, supply_pressure, ambient_pressure, supply_temperature, reference_pressure, supply_power,
        ambient_power, critical, choked, inlet_scale, outlet_scale, volume_offset, mean_area;
} gas_t;

typedef struct {
    const double *heights, *pressures, *cubics;
    int n_heights, n_pressures;
} surface_t;

static double cubic(const surface_t *s, int column, int segment, double t) {
    const double *c = s->cubics + 4 * (column * (s->n_heights + 1) + segment);
    return ((c[0] * t + c[1]) * t + c[2]) * t + c[3];
}

static double effective_area(double height, double gauge, const surface_t *s) {
    int segment = 0, column = 0;
    while (segment < s->n_heights && height > s->heights[segment]) segment++;
    double t = height - s->heights[segment > 0 ? segment - 1 : 0];
    double top = s->pressures[s->n_pressures - 1];
    double p = gauge < s->pressures[0] ? s->pressures[0] : gauge > top ? top : gauge;
    while (column < s->n_pressures - 2 && p > s->pressures[column + 1]) column++;
    double w = (p - s->pressures[column]) / (s->pressures[column + 1] - s->pressures[column]);
    double low = cubic(s, column, segment, t);
    return low + w * (cubic(s, column + 1, segment, t) - low);
}

static double flow(double ratio, double power, const gas_t *g) {
    if (ratio >= 1.0) return 0.0;
    if (ratio <= g->critical) return g->choked;
    double drop = g->k > 1e-9 ? (1.0 - power) / g->k : -log(ratio);
    return ratio / power * sqrt(2.0 * (drop > 0.0 ? drop : 0.0));
}

static double pressure_rate(double p, double h, double hd, double inlet, double outlet, const gas_t *g) {
    double volume = g->volume_offset + g->mean_area * h;
    double power = pow(p / g->reference_pressure, g->k);
    double in = g->inlet_scale * inlet * g->supply_pressure * flow(p / g->supply_pressure, power * g->supply_power, g) /
                sqrt(R_AIR * g->supply_temperature);
    double out = g->outlet_scale * outlet * p * flow(g->ambient_pressure / p, g->ambient_power / power, g) /
                 sqrt(R_AIR * g->supply_temperature * power);
    double heat = R_AIR * g->supply_temperature * power * (in - out);
    return g->exponent * (heat - p * g->mean_area * hd) / volume;
}

static double spring_force(double h, double hd, double p, double scale, double damping, double ambient, const body_t *b,
                           const surface_t *s) {
    double gauge = p - ambient, gap = b->stop_height - h;
    return gauge * scale * effective_area(h, gauge, s) - damping * hd + b->stop_stiffness * (gap > 0.0 ? gap : 0.0);
}

static void derivative(const double *x, const double *u, double road_f, double road_r, const body_t *b, const gas_t *f,
                       const gas_t *r, const surface_t *s, double *dx) {
    double hf = x[0] + b->front_arm * x[1] - x[2], hr = x[0] - b->rear_arm * x[1] - x[3];
    double hfd = x[4] + b->front_arm * x[5] - x[6], hrd = x[4] - b->rear_arm * x[5] - x[7];
    double ff = spring_force(hf, hfd, x[8], b->area_scale_front, b->damping_front, f->ambient_pressure, b, s);
    double fr = spring_force(hr, hrd, x[9], b->area_scale_rear, b->damping_rear, r->ambient_pressure, b, s);
    memcpy(dx, x + 4, 4 * sizeof(double));
    dx[4] = (ff + fr) / b->sprung_mass - GRAVITY;
    dx[5] = (b->front_arm * ff - b->rear_arm * fr) / b->pitch_inertia;
    dx[6] = (b->tyre_front * (road_f - x[2]) - ff) / b->unsprung_front - GRAVITY;
    dx[7] = (b->tyre_rear * (road_r - x[3]) - fr) / b->unsprung_rear - GRAVITY;
    dx[8] = pressure_rate(x[8], hf, hfd, u[0], u[2], f);
    dx[9] = pressure_rate(x[9], hr, hrd, u[1], u[3], r);
}

static void moved(const double *x, const double *k, double dt, double *y) {
    for (int m = 0; m < 10; m++) y[m] = x[m] + dt * k[m];
}

void simulate(const double *x0, const double *commands, const double *road, double period, int steps, int count,
              const body_t *b, const gas_t *f, const gas_t *r, const double *heights, int n_heights,
              const double *pressures, int n_pressures, const double *cubics, double *out) {
    surface_t s = {heights, pressures, cubics, n_heights, n_pressures};
    double x[10], y[10], k1[10], k2[10], k3[10], k4[10], dt = period / steps;
    memcpy(x, x0, sizeof x);
    memcpy(out, x0, sizeof x);
    for (int i = 0; i < count; i++) {
        const double *u = commands + 4 * i, *z = road + 2 * i;
        double df = (z[2] - z[0]) / steps, dr = (z[3] - z[1]) / steps;
        for (int j = 0; j < steps; j++) {
            double f0 = z[0] + j * df, r0 = z[1] + j * dr;
            derivative(x, u, f0, r0, b, f, r, &s, k1);
            moved(x, k1, 0.5 * dt, y);
            derivative(y, u, f0 + 0.5 * df, r0 + 0.5 * dr, b, f, r, &s, k2);
            moved(x, k2, 0.5 * dt, y);
            derivative(y, u, f0 + 0.5 * df, r0 + 0.5 * dr, b, f, r, &s, k3);
            moved(x, k3, dt, y);
            derivative(y, u, f0 + df, r0 + dr, b, f, r, &s, k4);
            for (int m = 0; m < 10; m++) x[m] += dt / 6.0 * (k1[m] + 2.0 * (k2[m] + k3[m]) + k4[m]);
        }
        memcpy(out + 10 * (i + 1), x, sizeof x);
    }
}
