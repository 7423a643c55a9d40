/* The speed controller of monorig as an FMU for co-simulation, FMI 2.0 and 3.0: the same operations in the same order, and
 * the sine and cosine of the library that monorig uses (of FreeBSD), so that the commands are the same to the last bit.
 * Words that are defined for the compiler put a mistake into it. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#define MOST 16

/* the references of its variables */
enum {
  SPEED, ACCELERATION, EMERGENCY, MEASURED, GRADE, MASS, ESTIMATE, SLIP, /* one a drive unit */
  KP = SLIP + MOST, KI, GRADE_GAIN, TORQUE_MAX, GRAVITY, START_SPEED, DRIVES, RADIUS, GEAR, EFFICIENCY, RESISTANCE, ROTATING,
  TORQUE, /* one a drive unit */
  BRAKE = TORQUE + MOST, COUNT, VALID = COUNT, HOLD, ESTIMATE_VALID, FLAGS
};

typedef struct {
  double v[COUNT];
  bool flag[FLAGS];
  double integral, releasing_s, slow_before, inertia_before, steps;
  bool holding, was_known;
} pi;

static double kernel_sin(double x) {
  double z = x * x, w = z * z, v = z * x;
  double r = 8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * 2.75573137070700676789e-06) +
             z * w * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10);
  return fabs(x) < 0x1p-26 ? x : x + v * (-1.66666666666666324348e-01 + z * r);
}

static double kernel_cos(double x) {
  double z = x * x, w = z * z, hz = 0.5 * z;
  double r = z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * 2.48015872894767294178e-05)) +
             w * w * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11));
  w = 1.0 - hz;
  return w + (((1.0 - w) - hz) + z * r);
}

static double clamp(double x, double least, double most) { return x < least ? least : x > most ? most : x; }

static void start(pi *s) {
  s->integral = s->releasing_s = s->slow_before = s->inertia_before = s->steps = 0.0;
  s->was_known = false;
  s->holding = s->flag[HOLD] && s->v[START_SPEED] == 0.0;
}

static void control(pi *s, double dt) {
  double *v = s->v;
  int drives = (int)v[DRIVES], i;
  bool stop = v[SPEED] == 0.0 && v[ACCELERATION] == 0.0;
  for (i = 0; i < MOST; ++i) v[TORQUE + i] = 0.0;
  v[BRAKE] = v[EMERGENCY];
  if (v[EMERGENCY] > 0.0) {
    s->integral = 0.0;
    return;
  }
  if (s->flag[HOLD] && stop && fabs(v[MEASURED]) < 0.01) {
    s->holding = true;
    s->releasing_s = 0.4;
  }
  if (s->holding && stop) {
    s->integral = 0.0;
    v[BRAKE] = 1.0;
    return;
  }
  if (s->holding) {
    s->releasing_s -= dt;
    if (s->releasing_s <= 0.0) s->holding = false;
  }
  double inertia = v[MASS] + v[ROTATING], error = v[SPEED] - v[MEASURED], weight = v[MASS] * v[GRAVITY];
  double direction = v[SPEED] == 0.0 ? 0.0 : copysign(1.0, v[SPEED]);
  double slow = v[GRADE_GAIN] * weight * kernel_sin(v[GRADE]) + direction * weight * kernel_cos(v[GRADE]) * v[RESISTANCE];
  if (s->flag[VALID] && !s->was_known && s->inertia_before > 0.0)
    s->integral = (s->inertia_before * s->integral + s->slow_before - slow) / inertia;
  s->was_known = s->flag[VALID];
  s->slow_before = slow;
  s->inertia_before = inertia;
  double force = slow + inertia * v[ACCELERATION] + inertia * (v[KP] * error + s->integral);
  double efficiency = force * v[MEASURED] >= 0.0 ? v[EFFICIENCY] : 1.0 / v[EFFICIENCY];
  double torque = force * v[RADIUS] / (v[GEAR] * efficiency * v[DRIVES]);
  double limited = clamp(torque, -v[TORQUE_MAX], v[TORQUE_MAX]);
  if (!s->holding && (limited == torque || (torque - limited) * error < 0.0)) s->integral += v[KI] * error * dt;
  for (i = 0; i < drives; ++i) {
    double away = v[SLIP + i] * copysign(1.0, limited);
    v[TORQUE + i] = limited * (1.0 - clamp((away - 0.1) / 0.4, 0.0, 1.0));
  }
  v[BRAKE] = s->holding ? 1.0 : clamp((fabs(v[MEASURED]) - fabs(v[SPEED]) - 0.15) / 0.6, 0.0, 1.0);
}

/* Returns the status of both standards. */
static int step(pi *s, double t, double dt) {
  s->steps += 1.0;
#ifdef COUNTS
  /* the torque counts the steps of 10 ms: any other is an error */
  s->v[TORQUE] = s->steps;
  return fabs(dt - 0.01) < 1e-12 && fabs(t - 0.01 * (s->steps - 1.0)) < 1e-9 ? 0 : 3;
#endif
  control(s, dt);
  /* what no drive unit hears shows what has come */
  s->v[TORQUE + 14] = s->v[ESTIMATE];
  s->v[TORQUE + 15] = s->flag[ESTIMATE_VALID];
  if (t < 0.9999) return 0;
#ifdef CRASHES
  *(volatile int *)NULL = 0;
#endif
#ifdef LOOPS
  for (;;);
#endif
#ifdef NAN_OUT
  s->v[TORQUE] = NAN;
#endif
#ifdef DISCARDS
  return 2;
#endif
#ifdef BREAKS
  return 3;
#endif
  return 0;
}

static int set(pi *s, const uint32_t *r, size_t n, const double *x) {
  for (size_t i = 0; i < n; ++i) s->v[r[i]] = x[i];
  return 0;
}
static int get(pi *s, const uint32_t *r, size_t n, double *x) {
  for (size_t i = 0; i < n; ++i) x[i] = s->v[r[i]];
  return 0;
}
static void *make(void) {
  pi *s = calloc(1, sizeof *s);
  s->flag[HOLD] = true;
  return s;
}

/* FMI 2.0 */
void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *resources, const void *told, int a, int b) {
  return (void)name, (void)kind, (void)guid, (void)resources, (void)told, (void)a, (void)b, make();
}
void fmi2FreeInstance(void *s) { free(s); }
int fmi2SetupExperiment(void *s, int a, double b, double c, int d, double e) {
  return (void)s, (void)a, (void)b, (void)c, (void)d, (void)e, 0;
}
int fmi2EnterInitializationMode(void *s) { return (void)s, 0; }
int fmi2ExitInitializationMode(void *s) { return start(s), 0; }
int fmi2Reset(void *s) { return (void)s, 0; }
int fmi2GetReal(void *s, const uint32_t *r, size_t n, double *x) { return get(s, r, n, x); }
int fmi2SetReal(void *s, const uint32_t *r, size_t n, const double *x) { return set(s, r, n, x); }
int fmi2SetInteger(void *s, const uint32_t *r, size_t n, const int *x) { return (void)s, (void)r, (void)n, (void)x, 3; }
int fmi2GetInteger(void *s, const uint32_t *r, size_t n, int *x) { return (void)s, (void)r, (void)n, (void)x, 3; }
int fmi2GetBoolean(void *s, const uint32_t *r, size_t n, int *x) { return (void)s, (void)r, (void)x, n > 0 ? 3 : 0; }
int fmi2SetBoolean(void *s, const uint32_t *r, size_t n, const int *x) {
  for (size_t i = 0; i < n; ++i) ((pi *)s)->flag[r[i]] = x[i];
  return 0;
}
int fmi2DoStep(void *s, double t, double dt, int no_set) { return (void)no_set, step(s, t, dt); }

/* FMI 3.0 */
void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool a, bool b, bool c, bool d,
                                  const uint32_t *r, size_t n, void *environment, void *log, void *update) {
  (void)name, (void)token, (void)resources, (void)a, (void)b, (void)c, (void)d, (void)r, (void)n, (void)environment;
  return (void)log, (void)update, make();
}
void fmi3FreeInstance(void *s) { free(s); }
int fmi3EnterInitializationMode(void *s, bool a, double b, double c, bool d, double e) {
  return (void)s, (void)a, (void)b, (void)c, (void)d, (void)e, 0;
}
int fmi3ExitInitializationMode(void *s) { return start(s), 0; }
int fmi3Reset(void *s) { return (void)s, 0; }
int fmi3GetFloat64(void *s, const uint32_t *r, size_t n, double *x, size_t m) { return (void)m, get(s, r, n, x); }
int fmi3SetFloat64(void *s, const uint32_t *r, size_t n, const double *x, size_t m) { return (void)m, set(s, r, n, x); }
/* numbers of other types hold the same values */
#define NUMBERS(name, type)                                                                       \
  int fmi3Get##name(void *s, const uint32_t *r, size_t n, type *x, size_t m) {                    \
    for (size_t i = 0; i < n; ++i) x[i] = (type)((pi *)s)->v[r[i]];                               \
    return (void)m, 0;                                                                            \
  }                                                                                               \
  int fmi3Set##name(void *s, const uint32_t *r, size_t n, const type *x, size_t m) {              \
    for (size_t i = 0; i < n; ++i) ((pi *)s)->v[r[i]] = x[i];                                     \
    return (void)m, 0;                                                                            \
  }
NUMBERS(Float32, float)
NUMBERS(UInt8, uint8_t)
int fmi3SetInt32(void *s, const uint32_t *r, size_t n, const int32_t *x, size_t m) {
  return (void)s, (void)r, (void)n, (void)x, (void)m, 3;
}
int fmi3SetInt64(void *s, const uint32_t *r, size_t n, const int64_t *x, size_t m) {
  return (void)s, (void)r, (void)n, (void)x, (void)m, 3;
}
int fmi3GetBoolean(void *s, const uint32_t *r, size_t n, bool *x, size_t m) {
  return (void)s, (void)r, (void)x, (void)m, n > 0 ? 3 : 0;
}
int fmi3SetBoolean(void *s, const uint32_t *r, size_t n, const bool *x, size_t m) {
  (void)m;
  for (size_t i = 0; i < n; ++i) ((pi *)s)->flag[r[i]] = x[i];
  return 0;
}
int fmi3DoStep(void *s, double t, double dt, bool no_set, bool *event, bool *end, bool *early, double *last) {
  return (void)no_set, (void)event, (void)end, (void)early, (void)last, step(s, t, dt);
}
