/* Start of a Cortex-M4F: vector table, FPU, memory. */
#include <stdint.h>

extern uint32_t stack_top, data_from, data_start, data_end, bss_start, bss_end;
int main(void);
void leave(int code);

#define CPACR (*(volatile uint32_t *)0xE000ED88u)

void reset(void) {
  /* full access to the coprocessors 10 and 11, the FPU, before the first number of it; then the barriers */
  CPACR |= 0xFu << 20;
  __asm volatile("dsb\n isb");
  for (uint32_t *from = &data_from, *to = &data_start; to < &data_end;) *to++ = *from++;
  for (uint32_t *to = &bss_start; to < &bss_end;) *to++ = 0;
  leave(main());
}

/* Every fault: your board would restart here. */
void fault(void) { leave(2); }

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    &stack_top, (void *)reset, (void *)fault, (void *)fault, (void *)fault, (void *)fault, (void *)fault};
