/* An FMU for co-simulation, FMI 2.0, of a stranger: slope by a low-pass of what the accelerometer shows. Its names are not
 * ours. Words that are defined for the compiler put a mistake into it. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>

typedef void (*logger)(void *, const char *, int, const char *, const char *, ...);
typedef struct {
  logger log;
  void *(*allocate)(size_t, size_t);
  void (*release)(void *);
  void *finished;
  void *environment;
} callbacks;

/* 1 ax, 2 wheel, 3 gain, 4 theta, 5 theta_sd, 6 ok, 7 order, 8 form */
typedef struct {
  const callbacks *told; /* kept, as many do */
  double value[9];
  int integer[9];
  double steps;
} slope;

#define OK 0
#define DISCARD 2
#define ERROR 3

const char *fmi2GetVersion(void) { return "2.0"; }
const char *fmi2GetTypesPlatform(void) { return "default"; }

void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *resources, const callbacks *told,
                      int visible, int logging) {
  slope *s;
  (void)name, (void)guid, (void)resources, (void)visible, (void)logging;
#ifdef NO_LICENCE
  told->log(told->environment, name, ERROR, "error", "no licence for %s, %d left", "slope", 0);
  return NULL;
#endif
  if (kind != 1) return NULL;
  s = told->allocate(1, sizeof *s);
  s->told = told;
  s->value[3] = 0.5;
  return s;
}
void fmi2FreeInstance(void *s) { ((slope *)s)->told->release(s); }
int fmi2SetupExperiment(void *s, int a, double b, double c, int d, double e) {
  return (void)s, (void)a, (void)b, (void)c, (void)d, (void)e, OK;
}
int fmi2EnterInitializationMode(void *s) { return (void)s, OK; }
int fmi2ExitInitializationMode(void *s) { return (void)s, OK; }
#ifndef NO_RESET
int fmi2Reset(void *at) {
  slope *s = at;
  s->value[4] = s->steps = 0.0;
  return OK;
}
#endif
int fmi2GetReal(void *at, const unsigned *r, size_t n, double *to) {
  size_t i;
  for (i = 0; i < n; ++i) to[i] = ((slope *)at)->value[r[i]];
  return OK;
}
int fmi2SetReal(void *at, const unsigned *r, size_t n, const double *x) {
  size_t i;
  for (i = 0; i < n; ++i) ((slope *)at)->value[r[i]] = x[i];
  return OK;
}
int fmi2GetInteger(void *at, const unsigned *r, size_t n, int *to) {
  size_t i; /* any of them is the order */
  (void)r;
  for (i = 0; i < n; ++i) to[i] = ((slope *)at)->integer[7];
  return OK;
}
int fmi2SetInteger(void *at, const unsigned *r, size_t n, const int *x) {
  size_t i;
  for (i = 0; i < n; ++i) ((slope *)at)->integer[r[i]] = x[i];
  return OK;
}
int fmi2SetBoolean(void *at, const unsigned *r, size_t n, const int *x) { return (void)at, (void)r, (void)n, (void)x, OK; }
int fmi2GetBoolean(void *at, const unsigned *r, size_t n, int *to) {
  size_t i;
  (void)at, (void)r;
  for (i = 0; i < n; ++i) to[i] = 1;
  return OK;
}
int fmi2DoStep(void *at, double t, double dt, int no_set) {
  slope *s = at;
  const callbacks *told = s->told;
  double follow = s->value[3] * dt;
  (void)no_set;
  s->steps += 1.0;
  s->value[5] = 0.01;
#ifdef NAN_OUT
  s->value[4] = NAN;
  return OK;
#endif
#ifdef DISCARDS
  told->log(told->environment, "slope", DISCARD, "discard", "no fix at %.1f s", t);
  return DISCARD;
#endif
#ifdef BREAKS
  told->log(told->environment, "slope", ERROR, "error", "the memory is gone");
  return ERROR;
#endif
#ifdef FIXED_STEP
  /* the step that is told, and no other; theta counts the steps */
  s->value[4] = 1e-6 * s->steps;
  return fabs(dt - 0.02) < 1e-12 && fabs(t - 0.02 * (s->steps - 1.0)) < 1e-9 ? OK : ERROR;
#endif
  (void)told, (void)t;
  s->value[4] += (follow < 1.0 ? follow : 1.0) * (asin(fmax(-1.0, fmin(1.0, s->value[1] / 9.81))) - s->value[4]);
  return OK;
}
