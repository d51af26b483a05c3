/* Preloaded into a program: its wall clock is the machine's, shifted by the whole seconds that the file WEFT_SHIFTED_CLOCK names. */
#include <stdio.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

int clock_gettime(clockid_t clock, struct timespec* now) {
  const long outcome = syscall(SYS_clock_gettime, clock, now);
  const char* const name = getenv("WEFT_SHIFTED_CLOCK");
  if (outcome != 0 || clock != CLOCK_REALTIME || name == NULL) return (int)outcome;
  FILE* const file = fopen(name, "r");
  if (file == NULL) return (int)outcome;
  long shift_s = 0;
  if (fscanf(file, "%ld", &shift_s) == 1) now->tv_sec += shift_s;
  fclose(file);
  return (int)outcome;
}
