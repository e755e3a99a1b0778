// LD_PRELOAD: makes calls of the system fail, or the clock jump, to see what a program does then.
//
//   RESTAGE_FAULT_FOLDER  calls on files below this folder are counted: those that make, write,
//                         synchronise, close what was written, rename or remove
//   RESTAGE_FAULT_AT      the n-th of them, from 1, goes wrong; 0: none
//   RESTAGE_FAULT_KIND    ENOSPC: from that call on, of calls that need space; EIO: that call alone;
//                         SHORT: that call writes half of what it was given, at least a byte
//   RESTAGE_FAULT_COUNT   a file into which the number of calls is written at the end
//   RESTAGE_CLOCK_JUMPS   the wall clock jumps by a day, forwards and backwards, every 5 calls
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static atomic_long calls;

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static int below(const char* path) {
  const char* folder = getenv("RESTAGE_FAULT_FOLDER");
  if (!folder || !path) return 0;
  if (path[0] == '/') return strncmp(path, folder, strlen(folder)) == 0;
  char full[2 * PATH_MAX];
  if (!getcwd(full, PATH_MAX)) return 0;
  strcat(full, "/");
  strncat(full, path, PATH_MAX - 1);
  return strncmp(full, folder, strlen(folder)) == 0;
}

static int open_below(int fd) {
  char link[64], path[PATH_MAX];
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t length = readlink(link, path, sizeof path - 1);
  if (length < 0) return 0;
  path[length] = 0;
  return below(path);
}

enum { FINE, FAILS, SHORT };

// What is to happen to this call; errno is set if it fails.
static int fate(int needs_space) {
  const long n = atomic_fetch_add(&calls, 1) + 1;
  const char *at = getenv("RESTAGE_FAULT_AT"), *kind = getenv("RESTAGE_FAULT_KIND");
  const long when = at ? atol(at) : 0;
  if (when == 0 || !kind) return FINE;
  if (strcmp(kind, "ENOSPC") == 0 && n >= when && needs_space) return errno = ENOSPC, FAILS;
  if (strcmp(kind, "EIO") == 0 && n == when) return errno = EIO, FAILS;
  if (strcmp(kind, "SHORT") == 0 && n == when) return SHORT;
  return FINE;
}

__attribute__((destructor)) static void tell(void) {
  const char* path = getenv("RESTAGE_FAULT_COUNT");
  if (!path) return;
  FILE* file = fopen(path, "w");
  if (!file) return;
  fprintf(file, "%ld\n", atomic_load(&calls));
  fclose(file);
}

static int writes(int flags) { return (flags & O_ACCMODE) != O_RDONLY; }

#define OPEN(name)                                                                  \
  int name(const char* path, int flags, ...) {                                      \
    va_list more;                                                                   \
    va_start(more, flags);                                                          \
    const mode_t mode = (mode_t)va_arg(more, int);                                  \
    va_end(more);                                                                   \
    if (writes(flags) && below(path) && fate((flags & O_CREAT) != 0) == FAILS) return -1; \
    return REAL(name)(path, flags, mode);                                           \
  }
OPEN(open)
OPEN(open64)

ssize_t write(int fd, const void* data, size_t size) {
  if (size > 0 && open_below(fd)) {
    const int what = fate(1);
    if (what == FAILS) return -1;
    if (what == SHORT) size = size / 2 > 0 ? size / 2 : 1;
  }
  return REAL(write)(fd, data, size);
}

int fsync(int fd) { return open_below(fd) && fate(0) == FAILS ? -1 : REAL(fsync)(fd); }
int fdatasync(int fd) { return open_below(fd) && fate(0) == FAILS ? -1 : REAL(fdatasync)(fd); }

int close(int fd) {
  const int flags = fcntl(fd, F_GETFL);
  const int fails = flags >= 0 && writes(flags) && open_below(fd) && fate(0) == FAILS;
  const int code = errno, result = REAL(close)(fd);  // it is closed even so
  if (!fails) return result;
  errno = code;
  return -1;
}

int ftruncate(int fd, off_t size) {
  return open_below(fd) && fate(0) == FAILS ? -1 : REAL(ftruncate)(fd, size);
}
int ftruncate64(int fd, off64_t size) {
  return open_below(fd) && fate(0) == FAILS ? -1 : REAL(ftruncate64)(fd, size);
}
int rename(const char* from, const char* to) {
  return below(to) && fate(1) == FAILS ? -1 : REAL(rename)(from, to);
}
int mkdir(const char* path, mode_t mode) {
  return below(path) && fate(1) == FAILS ? -1 : REAL(mkdir)(path, mode);
}
int unlink(const char* path) {
  return below(path) && fate(0) == FAILS ? -1 : REAL(unlink)(path);
}

int clock_gettime(clockid_t clock, struct timespec* time) {
  const int result = REAL(clock_gettime)(clock, time);
  static atomic_long asked;
  if (result == 0 && clock == CLOCK_REALTIME && getenv("RESTAGE_CLOCK_JUMPS"))
    time->tv_sec += (atomic_fetch_add(&asked, 1) / 5 % 2 ? -1 : 1) * 86400;
  return result;
}
