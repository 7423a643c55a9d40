/* An estimator that does what no estimator should, one thing for each name defined by -D. */
#define _DEFAULT_SOURCE
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "monorig_estimator.h"

/* What it does at last. */
static void misbehave(void) {
#ifdef SEGFAULT
  *(volatile int *)8 = 1;
#endif
#ifdef ABORTS
  abort();
#endif
#ifdef EXITS
  exit(3);
#endif
#ifdef MARKS
  fclose(fopen("RAN", "w"));
#endif
#ifdef ASKS_FOR_MEMORY
  if (!malloc((size_t)5 << 30)) exit(4);
#endif
#ifdef FORKS
  if (fork() == 0)
    for (;;) pause();
#endif
#ifdef SLOW
  usleep(400000);
#endif
#ifdef LOOPS
  for (volatile int i = 0;; i++) {}
#endif
}

#ifdef AT_LOADING
__attribute__((constructor)) static void at_loading(void) { misbehave(); }
#endif
uint32_t monorig_abi(void) { return MONORIG_ABI; }
int32_t monorig_name_at(uint64_t i, monorig_label *out) {
  if (i) return MONORIG_REFUSED;
  strcpy(out->name, "bad");
  return MONORIG_OK;
}
uint64_t monorig_size(const char *name) {
  (void)name;
  return 2 * sizeof(double);
}
void monorig_reset(void *memory) { memset(memory, 0, 2 * sizeof(double)); }
int32_t monorig_create(void *memory, const char *name, const monorig_vehicle *v, const monorig_setting *s, uint64_t n,
                       monorig_reason *why) {
  (void)name, (void)v, (void)s, (void)n, (void)why;
#ifdef AT_BUILDING
  misbehave();
#endif
  monorig_reset(memory);
  return MONORIG_OK;
}
int32_t monorig_step(void *memory, const monorig_input *z, monorig_estimate *out, monorig_reason *why) {
  double *t_s = memory, *first = t_s + 1;
  (void)why;
  *t_s += z->dt_s;
  if (*first == 0.0 && z->specific_force_mps2.t_ns != MONORIG_NONE) *first = z->specific_force_mps2.value[0];
#ifdef PRINTS
  printf("step at %f s\n", *t_s);
  fflush(stdout);
#endif
#ifdef AT_EACH_STEP
  misbehave();
#endif
#ifdef AT_RUNNING
  if (*t_s > 1.0) misbehave();
#endif
#ifdef WITH_SOME_SEEDS
  if (*t_s > 1.0 && *first > 0.0) misbehave();
#endif
  out->total_mass_kg = (monorig_value){19000.0, 20000.0, 1};
  out->grade_rad = out->effective_grade_rad = (monorig_value){0.0, 0.1, 1};
  return MONORIG_OK;
}
#ifdef SHOWS
int32_t monorig_internal_at(const void *memory, uint64_t i, monorig_label *out) {
  static const char *const names[] = {SHOWS};
  (void)memory;
  if (i >= sizeof names / sizeof *names) return MONORIG_REFUSED;
  strcpy(out->name, names[i]);
  return MONORIG_OK;
}
#endif
#ifdef AT_THE_END
void monorig_destroy(void *memory) { (void)memory, misbehave(); }
#endif
