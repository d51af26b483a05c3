/* Preloaded into a program: each pseudo-terminal /dev/pts/N becomes the serial port /dev/ttyPTSN,
 * with modem lines and a device behind it in /sys, so that libserialport opens it
 * (docs/reference/device-facts.md, Serial ports). Each port opened this way, and each change of its
 * RTS line, adds a line to the file WEFT_REAL_PORT_LOG. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

static const char terminal[] = "/dev/pts/", port[] = "/dev/ttyPTS",
                  class_of_port[] = "/sys/class/tty/ttyPTS";

static int begins(const char* text, const char* start) {
  return strncmp(text, start, strlen(start)) == 0;
}

static void note(const char* what, const char* of) {
  const char* const name = getenv("WEFT_REAL_PORT_LOG");
  if (name == NULL) return;
  char line[PATH_MAX];
  const int length = snprintf(line, sizeof line, "%s %s\n", what, of);
  const int file = (int)syscall(SYS_openat, AT_FDCWD, name, O_WRONLY | O_APPEND | O_CREAT, 0600);
  if (file < 0) return;
  if (write(file, line, (size_t)length) != length) _exit(99);
  close(file);
}

char* realpath(const char* path, char* resolved) {
  char* (*next)(const char*, char*) = NULL;
  *(void**)&next = dlsym(RTLD_NEXT, "realpath");
  char* const found = next(path, resolved);
  if (found == NULL || !begins(found, terminal)) return found;
  char* const as_port = resolved != NULL ? resolved : malloc(PATH_MAX);
  char number[16];
  snprintf(number, sizeof number, "%s", found + strlen(terminal));
  snprintf(as_port, PATH_MAX, "%s%s", port, number);
  if (resolved == NULL) free(found);
  return as_port;
}

struct Name {
  char text[PATH_MAX];
};

/* The kernel's name of the port. */
static struct Name kernels(const char* path) {
  struct Name name;
  if (begins(path, port))
    snprintf(name.text, sizeof name.text, "%s%s", terminal, path + strlen(port));
  else
    snprintf(name.text, sizeof name.text, "%s", path);
  return name;
}

static int opened(const char* path, int flags, mode_t mode) {
  const struct Name name = kernels(path);
  const int descriptor = (int)syscall(SYS_openat, AT_FDCWD, name.text, flags, mode);
  if (descriptor >= 0 && begins(path, port)) note("opened", path);
  return descriptor;
}

int stat(const char* path, struct stat* found) {
  const struct Name name = kernels(path);
  return fstatat(AT_FDCWD, name.text, found, 0);
}

int access(const char* path, int mode) {
  const struct Name name = kernels(path);
  return (int)syscall(SYS_faccessat, AT_FDCWD, name.text, mode);
}

int open(const char* path, int flags, ...) {
  mode_t mode = 0;
  if (flags & (O_CREAT | O_TMPFILE)) {
    va_list more;
    va_start(more, flags);
    mode = va_arg(more, mode_t);
    va_end(more);
  }
  return opened(path, flags, mode);
}

int __open_2(const char* path, int flags) {
  return opened(path, flags, 0);
}

int __lxstat(int version, const char* path, struct stat* found) {
  (void)version;
  if (!begins(path, class_of_port)) return lstat(path, found);
  memset(found, 0, sizeof *found);
  found->st_mode = S_IFLNK | 0777;
  return 0;
}

ssize_t readlink(const char* path, char* into, size_t size) {
  static const char device[] = "../../devices/platform/weft/tty";
  if (!begins(path, class_of_port)) return syscall(SYS_readlinkat, AT_FDCWD, path, into, size);
  const size_t length = size < sizeof device - 1 ? size : sizeof device - 1;
  memcpy(into, device, length);
  return (ssize_t)length;
}

int ioctl(int descriptor, unsigned long request, ...) {
  va_list more;
  va_start(more, request);
  void* const argument = va_arg(more, void*);
  va_end(more);
  const int outcome = (int)syscall(SYS_ioctl, descriptor, request, argument);
  if (outcome == 0 || errno != ENOTTY) return outcome;
  switch (request) {
    case TIOCMGET:
      *(int*)argument = TIOCM_CTS | TIOCM_DSR | TIOCM_CAR;
      return 0;
    case TIOCMSET:
    case TIOCMBIS:
    case TIOCMBIC:
      note(request == TIOCMBIC ? "cleared" : "set", *(int*)argument & TIOCM_RTS ? "RTS" : "-");
      return 0;
    default:
      return outcome;
  }
}
