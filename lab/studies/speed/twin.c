/* The plant of birthsim_env/physics in C, written by hand from the textbook form of its equations: a second opinion on the
 * right-hand side, and what a compiler makes of it beside what Numba makes of the kernel.
 *
 * Arrays are laid out row by row, (rows, lanes), SI units; the rows of states and parameters are named by rows.h, which
 * twin.py writes from birthsim_env.physics.compiled.lanes. A block of LANES lanes is copied, integrated and copied back, so that the
 * innermost loops run over neighbouring lanes with a constant stride. Parameters that only spare divisions go unused. */

#include <math.h>

#include "rows.h" /* enum { Y1, ..., STATES }; enum { D_SQUARES, ..., PARAMETERS }; */

enum { LANES = 32 };

typedef double row[LANES];

static const double LINEAR_RATIO = 0.99;         /* of pressures, above which the flow falls linearly to zero */
static const double RELAXATION_LIMIT = 4500.0;   /* 1/s, of LuGre's bristle */
static const double ELASTO_PLASTIC_LIMIT = 3750.0; /* 1/s, of the elasto-plastic one */
static const double SMALLEST_LEVEL = 1e-9;       /* N */

/* psi of ISO 6358 at a pressure ratio Pd/Pu, in [0, 1]. */
static inline double flow_function(double ratio, double critical) {
    double scaled = (fmax(ratio, critical) - critical) / (1.0 - critical);
    double edge = (LINEAR_RATIO - critical) / (1.0 - critical);
    double subsonic = sqrt(fmax(1.0 - scaled * scaled, 0.0));
    double laminar = sqrt(1.0 - edge * edge) * (1.0 - ratio) / (1.0 - LINEAR_RATIO);
    return ratio > LINEAR_RATIO ? laminar : subsonic;
}

/* Mass flow through an orifice, kg/s: q = C rho0 Pu sqrt(T0/Tu) psi(Pd/Pu); negative where the far side has the higher pressure. */
static inline double orifice_flow(double conductance, double p_from, double t_from, double p_to, double t_to, double rho0,
                                  double t0, double critical) {
    double upstream = fmax(p_from, p_to);
    double temperature = p_from > p_to ? t_from : t_to;
    double psi = flow_function(fmin(p_from, p_to) / upstream, critical);
    double size = conductance * rho0 * upstream * sqrt(t0 / temperature) * psi;
    return p_from > p_to ? size : -size;
}

/* Part of a valve's conductance that one of its edges, whose three rows begin at `first` and lie 4 apart, opens after a stroke
 * towards it: t (1 + c (1 - t)) with t = (stroke - d) / (1 - d), multiplied out in stroke - d. */
static inline double opened(double stroke, const row *p, int first, int i) {
    double beyond = fmax(stroke - p[first][i], 0.0);
    return beyond * p[first + 4][i] - beyond * beyond * p[first + 8][i];
}

/* dP/dt and dT/dt of a chamber named by its state rows, in lane i; `length` is that of its air column, m. */
static inline void chamber(const row *x, const row *p, row *dx, int i, int pressure_row, int temperature_row, int other_row,
                           int spool_row, int area_row, int perimeter_row, double length, double length_rate) {
    double pressure = x[pressure_row][i], temperature = x[temperature_row][i], spool = x[spool_row][i];
    double wall = p[TEMPERATURE][i], area = p[area_row][i], gas = p[GAS][i], gamma = p[GAMMA][i];

    int valve = spool_row - S1P;
    double supply = p[CONDUCTANCE][i] * opened(spool, p, SUPPLY_OVERLAP_P1 + valve, i) + p[LEAKAGE_P1 + valve][i];
    double exhaust = p[CONDUCTANCE][i] * opened(-spool, p, EXHAUST_OVERLAP_P1 + valve, i) + p[LEAKAGE_P1 + valve][i];
    double q_in = orifice_flow(supply, p[SUPPLY][i], wall, pressure, temperature, p[RHO0][i], p[T0][i], p[CRITICAL][i]);
    double q_out = orifice_flow(exhaust, pressure, temperature, p[ATMOSPHERE][i], wall, p[RHO0][i], p[T0][i], p[CRITICAL][i]);

    /* Tin qin - T qout with every flow at its upstream temperature. */
    double entering = fmax(q_in, 0.0) - fmin(q_out, 0.0), leaving = fmax(q_out, 0.0) - fmin(q_in, 0.0);
    double carried = wall * entering - temperature * leaving;
    double surface = 2.0 * area + p[perimeter_row][i] * length;
    double heat = p[H_WALL][i] * surface * (wall - temperature) + p[G12][i] * (x[other_row][i] - temperature);

    double volume = p[DEAD_VOLUME][i] + area * length, volume_rate = area * length_rate;
    double pressure_rate = (gamma * gas * carried - gamma * pressure * volume_rate + (gamma - 1.0) * heat) / volume;
    dx[pressure_row][i] = pressure_rate;
    dx[temperature_row][i] =
        temperature * (pressure_rate / pressure + volume_rate / volume - (q_in - q_out) * gas * temperature / (pressure * volume));
}

/* dz/dt of a bristle, m/s, by LuGre or by the elasto-plastic law of Dupont et al. */
static inline double bristle_rate(double v, double z, double level, double s0, int lugre, double breakaway, double steepness) {
    double relaxation = s0 * fabs(v) / level;
    double along = v > 0.0 ? s0 * z / level : -s0 * z / level;
    double s = fmax(0.0, fmin(1.0, (along - breakaway) * steepness));
    double share = lugre ? 1.0 : s * s * (3.0 - 2.0 * s);
    double limit = lugre ? RELAXATION_LIMIT : ELASTO_PLASTIC_LIMIT;
    return (v - share * relaxation * z) * limit / fmax(relaxation, limit);
}

/* Coulomb friction of a piston, N, that moves at v between the absolute pressures p_p and p_n. */
static inline double coulomb(double v, double p_p, double p_n, double atmosphere, double unpressed, double growth,
                             double asymmetry) {
    double level = unpressed + growth * ((p_p - atmosphere) + (p_n - atmosphere));
    return fmax(level, 0.0) * (v > 0.0 ? 1.0 + asymmetry : 1.0 - asymmetry);
}

/* Friction of a piston, N, and the rate of its bristle, m/s. */
static inline double friction(double v, double z, double fc, double fv, const row *p, int i, double *bristle) {
    int lugre = p[LUGRE][i] > 0.5, has_bristle = p[BRISTLED][i] > 0.5;
    double ratio = v / p[STRIBECK][i], fs = p[STATIC_RATIO][i] * fc;
    double level = fmax(fc + (fs - fc) / (1.0 + ratio * ratio), SMALLEST_LEVEL);
    double rate = bristle_rate(v, z, level, p[S0][i], lugre, p[BREAKAWAY][i], p[STEEPNESS][i]);
    double by_bristle = p[S0][i] * z + p[S1][i] * rate + fv * v;
    double by_coulomb = fc * fmax(-1.0, fmin(1.0, v / p[SIGN_SPEED][i])) + fv * v;
    *bristle = has_bristle ? rate : 0.0;
    return has_bristle ? by_bristle : by_coulomb;
}

/* Force of the end stops against a piston, N: Hunt and Crossley, never pulling. */
static inline double stop_force(double y, double v, double half_stroke, double stiffness, double damping) {
    double depth = fmax(fabs(y) - half_stroke, 0.0);
    double push = stiffness * depth * fmax(1.0 + damping * (y > 0.0 ? v : -v), 0.0);
    return y > 0.0 ? push : -push;
}

/* Force of both chambers less that of the atmosphere on the rod (3), N. */
static inline double piston_force(double p_p, double p_n, double area_p, double area_n, double atmosphere) {
    return p_p * area_p - p_n * area_n - atmosphere * (area_p - area_n);
}

/* dx/dt of n lanes under opening commands u (4 rows) and a user's force f (2 rows, N). */
static void right_hand_side(const row *restrict x, const row *restrict u, const row *restrict f, const row *restrict p,
                            row *restrict dx, int n) {
    for (int i = 0; i < n; i++) {
        double y1 = x[Y1][i], v1 = x[V1][i], y2 = x[Y2][i], v2 = x[V2][i];

        /* The linkage: lengths r4 and r2, S^2 = (2 d3 d6)^2 - w^2, kappa and the tilt theta1 of cylinder 2. */
        double r4 = y1 + p[K1][i], r2 = y2 + p[K2][i];
        double w = r4 * r4 - p[D_SQUARES][i];
        double s2 = p[D_PRODUCT][i] * p[D_PRODUCT][i] - w * w, s = sqrt(s2);
        double sine = (p[SIN_GAMMA3][i] * s - p[COS_GAMMA3][i] * w) / p[D_PRODUCT][i];
        double cosine = (p[COS_GAMMA3][i] * s + p[SIN_GAMMA3][i] * w) / p[D_PRODUCT][i];
        double kappa = 2.0 * r2 * r4 / s;

        double dz1, dz2;
        double fc1 = coulomb(v1, x[PP1][i], x[PN1][i], p[ATMOSPHERE][i], p[FC1][i], p[FP1][i], p[ASYMMETRY1][i]);
        double fc2 = coulomb(v2, x[PP2][i], x[PN2][i], p[ATMOSPHERE][i], p[FC2][i], p[FP2][i], p[ASYMMETRY2][i]);
        double friction1 = friction(v1, x[Z1][i], fc1, p[FV1][i], p, i, &dz1);
        double friction2 = friction(v2, x[Z2][i], fc2, p[FV2][i], p, i, &dz2);
        double stop1 = stop_force(y1, v1, p[HALF_L1][i], p[STOP_STIFFNESS][i], p[STOP_DAMPING][i]);
        double stop2 = stop_force(y2, v2, p[HALF_L2][i], p[STOP_STIFFNESS][i], p[STOP_DAMPING][i]);
        double air1 = piston_force(x[PP1][i], x[PN1][i], p[AREA_P1][i], p[AREA_N1][i], p[ATMOSPHERE][i]);
        double air2 = piston_force(x[PP2][i], x[PN2][i], p[AREA_P2][i], p[AREA_N2][i], p[ATMOSPHERE][i]);
        double user1 = -kappa * (cosine * f[0][i] + sine * f[1][i]), user2 = sine * f[0][i] - cosine * f[1][i];
        double force1 = air1 - friction1 - stop1 + user1, force2 = air2 - friction2 - stop2 + user2;

        /* Accelerations (5). */
        double transport = 2.0 * r4 * w * v1 * v1 / s2 + 2.0 * v1 * v2 / r2 + v1 * v1 / r4;
        dx[Y1][i] = v1;
        dx[V1][i] = force1 * p[INVERSE_MASS1][i] / (kappa * kappa) + p[GRAVITY1][i] * sine / kappa - transport;
        dx[Y2][i] = v2;
        dx[V2][i] = force2 / p[MASS][i] + p[GRAVITY][i] * cosine + 4.0 * r2 * r4 * r4 * v1 * v1 / s2;
        dx[Z1][i] = dz1;
        dx[Z2][i] = dz2;

        chamber(x, p, dx, i, PP1, TP1, TN1, S1P, AREA_P1, PERIMETER1, p[HALF_L1][i] + y1, v1);
        chamber(x, p, dx, i, PN1, TN1, TP1, S1N, AREA_N1, PERIMETER1, p[HALF_L1][i] - y1, -v1);
        chamber(x, p, dx, i, PP2, TP2, TN2, S2P, AREA_P2, PERIMETER2, p[HALF_L2][i] + y2, v2);
        chamber(x, p, dx, i, PN2, TN2, TP2, S2N, AREA_N2, PERIMETER2, p[HALF_L2][i] - y2, -v2);
        for (int k = 0; k < 4; k++) dx[S1P + k][i] = (u[k][i] - x[S1P + k][i]) * p[k < 2 ? SPOOL_RATE1 : SPOOL_RATE][i];
    }
}

/* Adds weight dx to the running sum and puts the next trial state at x + ahead dx. */
static void stage(const row *restrict x, const row *restrict dx, row *restrict total, row *restrict trial, double weight,
                  double ahead, int n) {
    for (int r = 0; r < STATES; r++)
        for (int i = 0; i < n; i++) {
            total[r][i] += weight * dx[r][i];
            trial[r][i] = x[r][i] + ahead * dx[r][i];
        }
}

/* One Runge-Kutta step, s, of n lanes, by Ralston's method of third order; `impacts` grow to the largest speed into an end
 * stop, m/s. */
static void runge_kutta(row *x, const row *u, const row *f, const row *p, row *impacts, double step, int n) {
    row dx[STATES], total[STATES], trial[STATES];
    for (int r = 0; r < STATES; r++)
        for (int i = 0; i < n; i++) total[r][i] = x[r][i];
    right_hand_side(x, u, f, p, dx, n);
    stage(x, dx, total, trial, 2.0 * step / 9.0, step / 2.0, n);
    right_hand_side(trial, u, f, p, dx, n);
    stage(x, dx, total, trial, step / 3.0, 3.0 * step / 4.0, n);
    double last = 4.0 * step / 9.0;
    right_hand_side(trial, u, f, p, dx, n);
    for (int r = 0; r < STATES; r++)
        for (int i = 0; i < n; i++) x[r][i] = total[r][i] + last * dx[r][i];
    for (int i = 0; i < n; i++) {
        double into1 = x[Y1][i] > 0.0 ? x[V1][i] : -x[V1][i], into2 = x[Y2][i] > 0.0 ? x[V2][i] : -x[V2][i];
        impacts[0][i] = fmax(impacts[0][i], fabs(x[Y1][i]) > p[HALF_L1][i] ? into1 : 0.0);
        impacts[1][i] = fmax(impacts[1][i], fabs(x[Y2][i]) > p[HALF_L2][i] ? into2 : 0.0);
    }
}

/* Copies n lanes of an array (rows, lanes) into a block. */
static void load(const double *source, long lanes, int rows, int n, row *block) {
    for (int r = 0; r < rows; r++)
        for (int i = 0; i < n; i++) block[r][i] = source[r * lanes + i];
}

/* Copies n lanes of a block back. */
static void store(const row *block, int rows, int n, double *target, long lanes) {
    for (int r = 0; r < rows; r++)
        for (int i = 0; i < n; i++) target[r * lanes + i] = block[r][i];
}

/* As birthsim_env.physics.dynamics.advance: state (STATES, lanes) in place, command (4, lanes), forces (samples, 2, lanes), each
 * held for `steps` steps of `step` s, parameters (PARAMETERS, lanes); impacts (2, lanes) are overwritten. */
void advance(double *state, const double *command, const double *forces, const double *parameters, double *impacts, long lanes,
             long samples, long steps, double step) {
    for (long first = 0; first < lanes; first += LANES) {
        int n = lanes - first < LANES ? (int)(lanes - first) : LANES;
        row x[STATES], u[4], f[2], p[PARAMETERS], hit[2] = {{0.0}};
        load(state + first, lanes, STATES, n, x);
        load(command + first, lanes, 4, n, u);
        load(parameters + first, lanes, PARAMETERS, n, p);
        for (long sample = 0; sample < samples; sample++) {
            load(forces + 2 * lanes * sample + first, lanes, 2, n, f);
            for (long k = 0; k < steps; k++) runge_kutta(x, u, f, p, hit, step, n);
        }
        store(x, STATES, n, state + first, lanes);
        store(hit, 2, n, impacts + first, lanes);
    }
}
