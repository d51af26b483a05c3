/* Preloaded into a program: its wall clock is the machine's, shifted by the whole seconds in the
 * file WEFT_SHIFTED_CLOCK; its monotonic clock is shifted by those in WEFT_SHIFTED_STEADY. If
 * WEFT_LOCK_HANGS is set, a lock of a folder waits forever. */
#include <stdio.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

int clock_gettime(clockid_t clock, struct timespec* now) {
  const long outcome = syscall(SYS_clock_gettime, clock, now);
  const int is_wall = clock == CLOCK_REALTIME;
  const char* const name = getenv(is_wall ? "WEFT_SHIFTED_CLOCK" : "WEFT_SHIFTED_STEADY");
  if (outcome != 0 || (!is_wall && clock != CLOCK_MONOTONIC) || name == NULL) return (int)outcome;
  FILE* const file = fopen(name, "r");
  if (file == NULL) return (int)outcome;
  long shift_s = 0;
  if (fscanf(file, "%ld", &shift_s) == 1) now->tv_sec += shift_s;
  fclose(file);
  return (int)outcome;
}

int flock(int descriptor, int operation) {
  while (getenv("WEFT_LOCK_HANGS") != NULL) pause();
  return (int)syscall(SYS_flock, descriptor, operation);
}
