// Preloaded into darb: the n-th call of one kind on a file below a folder fails. Written files alone: a call counts where
// its path lies below HOSTILE_UNDER and the file is open for writing. Standard streams are not touched.
//   HOSTILE_UNDER   folder, absolute
//   HOSTILE_TRACE   file: a letter is appended to it for every call that counts (o w s r c f m)
//   HOSTILE_FAULT   letters : first call : last call : errno, or "short" for half of a write; calls count from 1
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static long calls;

static int below(const char* path) {
    const char* under = getenv("HOSTILE_UNDER");
    char full[2 * PATH_MAX];
    if (under == NULL || path == NULL) return 0;
    if (path[0] != '/') {
        if (getcwd(full, PATH_MAX) == NULL) return 0;
        strncat(full, "/", 2);
        strncat(full, path, PATH_MAX - 1);
        path = full;
    }
    return strncmp(path, under, strlen(under)) == 0;
}

static int below_fd(int fd) {
    char link[64], path[PATH_MAX];
    if (fd < 3) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    const ssize_t length = readlink(link, path, sizeof path - 1);
    if (length <= 0) return 0;
    path[length] = '\0';
    return below(path);
}

// 0: go on; else the errno to fail with, or -1: a short write.
static int strike(char letter) {
    const char* trace = getenv("HOSTILE_TRACE");
    const char* fault = getenv("HOSTILE_FAULT");
    int result = 0;
    pthread_mutex_lock(&lock);
    if (trace != NULL) {
        const int file = (int)syscall(SYS_openat, AT_FDCWD, trace, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
        if (file >= 0) {
            syscall(SYS_write, file, &letter, (size_t)1);
            syscall(SYS_close, file);
        }
    }
    char letters[32], what[32];
    long first, last;
    if (fault != NULL && sscanf(fault, "%31[^:]:%ld:%ld:%31s", letters, &first, &last, what) == 4 &&
        strchr(letters, letter) != NULL) {
        ++calls;
        if (calls >= first && calls <= last) result = strcmp(what, "short") == 0 ? -1 : atoi(what);
    }
    pthread_mutex_unlock(&lock);
    return result;
}

#define NEXT(name) __typeof__(&name) next = (__typeof__(&name))dlsym(RTLD_NEXT, #name)
#define FAIL_WITH(error, value) \
    do {                        \
        errno = (error);        \
        return value;           \
    } while (0)

static int open_strikes(const char* path, int flags) {
    return (flags & O_ACCMODE) != O_RDONLY && below(path) ? strike('o') : 0;
}

#define OPEN_BODY(name, ...)                                     \
    mode_t mode = 0;                                             \
    if (flags & (O_CREAT | O_TMPFILE)) {                         \
        va_list list;                                            \
        va_start(list, flags);                                   \
        mode = va_arg(list, mode_t);                             \
        va_end(list);                                            \
    }                                                            \
    const int error = open_strikes(path, flags);                 \
    if (error > 0) FAIL_WITH(error, -1);                         \
    NEXT(name);                                                  \
    return next(__VA_ARGS__, flags, mode);

int open(const char* path, int flags, ...) { OPEN_BODY(open, path) }
int open64(const char* path, int flags, ...) { OPEN_BODY(open64, path) }
int openat(int folder, const char* path, int flags, ...) { OPEN_BODY(openat, folder, path) }
int openat64(int folder, const char* path, int flags, ...) { OPEN_BODY(openat64, folder, path) }

#define FOPEN_BODY(name)                                                        \
    const int error = strpbrk(mode, "wa+") && below(path) ? strike('o') : 0;    \
    if (error > 0) FAIL_WITH(error, NULL);                                      \
    NEXT(name);                                                                 \
    return next(path, mode);

FILE* fopen(const char* path, const char* mode) { FOPEN_BODY(fopen) }
FILE* fopen64(const char* path, const char* mode) { FOPEN_BODY(fopen64) }

ssize_t write(int fd, const void* data, size_t size) {
    const int error = below_fd(fd) ? strike('w') : 0;
    if (error > 0) FAIL_WITH(error, -1);
    NEXT(write);
    return next(fd, data, error < 0 && size > 1 ? size / 2 : size);
}

size_t fwrite(const void* data, size_t size, size_t count, FILE* file) {
    const int error = below_fd(fileno(file)) ? strike('w') : 0;
    if (error > 0) FAIL_WITH(error, 0);
    NEXT(fwrite);
    return next(data, size, count, file);
}

int fputs(const char* text, FILE* file) {
    const int error = below_fd(fileno(file)) ? strike('w') : 0;
    if (error > 0) FAIL_WITH(error, EOF);
    NEXT(fputs);
    return next(text, file);
}

int fflush(FILE* file) {
    const int error = file != NULL && below_fd(fileno(file)) ? strike('f') : 0;
    if (error > 0) FAIL_WITH(error, EOF);
    NEXT(fflush);
    return next(file);
}

int fclose(FILE* file) {
    const int error = below_fd(fileno(file)) ? strike('c') : 0;
    NEXT(fclose);
    const int done = next(file);
    if (error > 0) FAIL_WITH(error, EOF);
    return done;
}

int fsync(int fd) {
    const int error = below_fd(fd) ? strike('s') : 0;
    if (error > 0) FAIL_WITH(error, -1);
    NEXT(fsync);
    return next(fd);
}

int rename(const char* from, const char* to) {
    const int error = below(to) ? strike('r') : 0;
    if (error > 0) FAIL_WITH(error, -1);
    NEXT(rename);
    return next(from, to);
}

int mkdir(const char* path, mode_t mode) {
    const int error = below(path) ? strike('m') : 0;
    if (error > 0) FAIL_WITH(error, -1);
    NEXT(mkdir);
    return next(path, mode);
}
