/* An estimator with a mistake, one for each name defined by -D. */
#include <string.h>
#include "monorig_estimator.h"

uint32_t monorig_abi(void) {
#ifdef OTHER_HEADER
  return MONORIG_ABI + 1;
#else
  return MONORIG_ABI;
#endif
}
int32_t monorig_name_at(uint64_t i, monorig_label *out) {
#ifdef NAMELESS
  return MONORIG_REFUSED;
#endif
  if (i) return MONORIG_REFUSED;
  strcpy(out->name, "bad");
  return MONORIG_OK;
}
uint64_t monorig_size(const char *name) {
  (void)name;
#ifdef SIZELESS
  return 0;
#else
  return 8;
#endif
}
int32_t monorig_parameter_at(const char *name, uint64_t i, monorig_parameter *out) {
  (void)name;
  if (i > 1) return MONORIG_REFUSED;
  memset(out, 0, sizeof *out);
  strcpy(out->name, i ? "form" : "gain");
  strcpy(out->doc, "A parameter.");
  out->kind = i ? MONORIG_WORD : MONORIG_NUMBER;
  out->otherwise = 1.0;
  strcpy(out->words, "round square");
#ifdef WRONG_RANGE
  out->least = 2.0;
#endif
  out->most = i ? 0.0 : 1.5;
  return MONORIG_OK;
}
int32_t monorig_create(void *memory, const char *name, const monorig_vehicle *v, const monorig_setting *s, uint64_t n,
                       monorig_reason *why) {
  (void)memory, (void)name, (void)v, (void)s, (void)n, (void)why;
#ifdef WILL_NOT
  strcpy(why->text, "no licence");
  return MONORIG_REFUSED;
#else
  return MONORIG_OK;
#endif
}
int32_t monorig_step(void *memory, const monorig_input *z, monorig_estimate *out, monorig_reason *why) {
  (void)memory, (void)z, (void)out, (void)why;
#ifdef NAN_VALID
  double zero = 0.0;
  out->grade_rad.value = zero / zero;
  out->grade_rad.valid = 1;
#endif
#ifdef NEGATIVE_SD
  out->total_mass_kg.sd = -1.0;
#endif
#ifdef REFUSES
  strcpy(why->text, "no fix");
  return MONORIG_REFUSED;
#endif
#ifdef BREAKS
  strcpy(why->text, "memory is gone");
  return MONORIG_BROKEN;
#endif
  return MONORIG_OK;
}
#ifndef NO_RESET
void monorig_reset(void *memory) { (void)memory; }
#endif
#ifdef ONE
uint32_t monorig_one_at_a_time(void) { return 1; }
#endif
