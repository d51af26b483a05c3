// A file system without one function, like some network shares: preloaded, it refuses the call that
// POOR_DISK names.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>

/// The function that the program would have called. POSIX allows a conversion of an object pointer
/// to a function pointer, ISO C does not.
#define NEXT(function, name) *(void**)(&(function)) = dlsym(RTLD_NEXT, name)

static int refuses(const char* what) {
  const char* named = getenv("POOR_DISK");
  return named != NULL && strcmp(named, what) == 0;
}

int flock(int descriptor, int operation) {
  static int (*next)(int, int);
  if (next == NULL) NEXT(next, "flock");
  if (refuses("flock")) return errno = ENOLCK, -1;
  return next(descriptor, operation);
}

int fsync(int descriptor) {
  static int (*next)(int);
  struct stat seen;
  if (next == NULL) NEXT(next, "fsync");
  if (refuses("fsync_folder") && fstat(descriptor, &seen) == 0 && S_ISDIR(seen.st_mode))
    return errno = EINVAL, -1;
  return next(descriptor);
}

static void* map(const char* name, void* at, size_t bytes, int protection, int flags,
                 int descriptor, off_t offset) {
  void* (*next)(void*, size_t, int, int, int, off_t);
  NEXT(next, name);
  if (refuses("mmap") && descriptor >= 0 && (flags & MAP_SHARED) && (protection & PROT_WRITE))
    return errno = ENODEV, MAP_FAILED;
  return next(at, bytes, protection, flags, descriptor, offset);
}

void* mmap(void* at, size_t bytes, int protection, int flags, int descriptor, off_t offset) {
  return map("mmap", at, bytes, protection, flags, descriptor, offset);
}

void* mmap64(void* at, size_t bytes, int protection, int flags, int descriptor, off_t offset) {
  return map("mmap64", at, bytes, protection, flags, descriptor, offset);
}

static int control(const char* name, int descriptor, int command, void* argument) {
  int (*next)(int, int, ...);
  NEXT(next, name);
  if (refuses("fcntl") && command == F_SETLK) return errno = ENOLCK, -1;
  return next(descriptor, command, argument);
}

int fcntl(int descriptor, int command, ...) {
  va_list more;
  va_start(more, command);
  void* argument = va_arg(more, void*);
  va_end(more);
  return control("fcntl", descriptor, command, argument);
}

int fcntl64(int descriptor, int command, ...) {
  va_list more;
  va_start(more, command);
  void* argument = va_arg(more, void*);
  va_end(more);
  return control("fcntl64", descriptor, command, argument);
}
