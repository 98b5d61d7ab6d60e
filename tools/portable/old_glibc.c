// For the portable darb: what Debian 12's glibc names by versions above 2.31, bound to the older
// versions that it still has. The linker is told --wrap for each name of OLD and of the functions
// below (cmake/portable.cmake reads them from here), so that libraries' references come here, too.
#define _GNU_SOURCE
#include <link.h>
#include <stddef.h>
#include <sys/random.h>
#include <sys/stat.h>

// The name, and the version that glibc 2.31 has of it on amd64. A jump, whatever its parameters.
#define OLD(name, version)                                 \
    __asm__(".symver old_" #name "," #name "@" version     \
            "\n.text\n.globl __wrap_" #name                \
            "\n.hidden __wrap_" #name                      \
            "\n.type __wrap_" #name                        \
            ",@function\n__wrap_" #name ": jmp *old_" #name \
            "@GOTPCREL(%rip)\n");
OLD(dlopen, "GLIBC_2.2.5")
OLD(dlsym, "GLIBC_2.2.5")
OLD(dlclose, "GLIBC_2.2.5")
OLD(dlerror, "GLIBC_2.2.5")
OLD(dladdr, "GLIBC_2.2.5")
OLD(hypot, "GLIBC_2.2.5")
OLD(hypotf, "GLIBC_2.2.5")
OLD(pthread_create, "GLIBC_2.2.5")
OLD(pthread_join, "GLIBC_2.2.5")
OLD(pthread_detach, "GLIBC_2.2.5")
OLD(pthread_cond_clockwait, "GLIBC_2.30")
OLD(pthread_once, "GLIBC_2.2.5")
OLD(__pthread_key_create, "GLIBC_2.2.5")
OLD(pthread_key_create, "GLIBC_2.2.5")
OLD(pthread_key_delete, "GLIBC_2.2.5")
OLD(pthread_getspecific, "GLIBC_2.2.5")
OLD(pthread_setspecific, "GLIBC_2.2.5")
OLD(pthread_mutex_trylock, "GLIBC_2.2.5")
OLD(pthread_rwlock_rdlock, "GLIBC_2.2.5")
OLD(pthread_rwlock_wrlock, "GLIBC_2.2.5")
OLD(pthread_rwlock_unlock, "GLIBC_2.2.5")
OLD(pthread_sigmask, "GLIBC_2.2.5")
OLD(sem_init, "GLIBC_2.2.5")
OLD(sem_wait, "GLIBC_2.2.5")
OLD(sem_post, "GLIBC_2.2.5")
OLD(sem_destroy, "GLIBC_2.2.5")

// Before 2.33 these were inline functions of the header, around others that take a number for the
// layout of struct stat: 1 on amd64.
__asm__(".symver old_xstat,__xstat@GLIBC_2.2.5\n.symver old_fxstat,__fxstat@GLIBC_2.2.5\n"
        ".symver old_lxstat,__lxstat@GLIBC_2.2.5\n.symver old_fxstatat,__fxstatat@GLIBC_2.4");
int old_xstat(int layout, const char* path, struct stat* result);
int old_fxstat(int layout, int file, struct stat* result);
int old_lxstat(int layout, const char* path, struct stat* result);
int old_fxstatat(int layout, int folder, const char* path, struct stat* result, int flags);
#define HIDDEN __attribute__((visibility("hidden")))
HIDDEN int __wrap_stat(const char* path, struct stat* result) { return old_xstat(1, path, result); }
HIDDEN int __wrap_fstat(int file, struct stat* result) { return old_fxstat(1, file, result); }
HIDDEN int __wrap_lstat(const char* path, struct stat* result) {
    return old_lxstat(1, path, result);
}
HIDDEN int __wrap_stat64(const char* path, struct stat* result) {
    return old_xstat(1, path, result);
}
HIDDEN int __wrap_fstat64(int file, struct stat* result) { return old_fxstat(1, file, result); }
HIDDEN int __wrap_lstat64(const char* path, struct stat* result) {
    return old_lxstat(1, path, result);
}
HIDDEN int __wrap_fstatat(int folder, const char* path, struct stat* result, int flags) {
    return old_fxstatat(1, folder, path, result, flags);
}

// Since 2.34 the C library runs a program's constructors itself; before, the program handed over a
// function for it (the fourth parameter, in rcx), which newer ones still call where there is one.
typedef void Initializer(int, char**, char**);
extern Initializer* __preinit_array_start[] HIDDEN;
extern Initializer* __preinit_array_end[] HIDDEN;
extern Initializer* __init_array_start[] HIDDEN;
extern Initializer* __init_array_end[] HIDDEN;
extern void _init(void);
HIDDEN void darb_run_constructors(int argc, char** argv, char** environment) {
    for (Initializer** one = __preinit_array_start; one != __preinit_array_end; ++one)
        (*one)(argc, argv, environment);
    _init();
    for (Initializer** one = __init_array_start; one != __init_array_end; ++one)
        (*one)(argc, argv, environment);
}
__asm__(".symver old_start_main,__libc_start_main@GLIBC_2.2.5\n"
        ".text\n.globl __wrap___libc_start_main\n.hidden __wrap___libc_start_main\n"
        "__wrap___libc_start_main: lea darb_run_constructors(%rip), %rcx\n"
        "jmp *old_start_main@GOTPCREL(%rip)\n");

// From 2.32: where it is true the shared counts of libstdc++ are not atomic. False is always right.
char __libc_single_threaded = 0;

// From 2.36, for std::random_device and libzip.
HIDDEN void __wrap_arc4random_buf(void* bytes, size_t count) {
    for (char* at = bytes; count > 0;) {
        const ssize_t got = getrandom(at, count, 0);
        if (got <= 0) continue;
        at += got;
        count -= (size_t)got;
    }
}
HIDDEN unsigned __wrap_arc4random(void) {
    unsigned value = 0;
    __wrap_arc4random_buf(&value, sizeof value);
    return value;
}

// From 2.35, for exceptions: the object that holds an address, and its table of frames.
struct Search {
    const char* address;
    struct dl_find_object* result;
};

static int holds_address(struct dl_phdr_info* object, size_t size, void* data) {
    (void)size;
    struct Search* search = data;
    const char* begin = NULL;
    const char* end = NULL;
    void* frames = NULL;
    for (int i = 0; i < object->dlpi_phnum; ++i) {
        const ElfW(Phdr)* part = &object->dlpi_phdr[i];
        const char* start = (const char*)(object->dlpi_addr + part->p_vaddr);
        if (part->p_type == PT_GNU_EH_FRAME) frames = (void*)start;
        if (part->p_type != PT_LOAD || search->address < start ||
            search->address >= start + part->p_memsz)
            continue;
        begin = start;
        end = start + part->p_memsz;
    }
    if (begin == NULL || frames == NULL) return 0;
    search->result->dlfo_map_start = (void*)begin;
    search->result->dlfo_map_end = (void*)end;
    search->result->dlfo_eh_frame = frames;
    return 1;
}

HIDDEN int __wrap__dl_find_object(void* address, struct dl_find_object* result) {
    struct Search search = {address, result};
    return dl_iterate_phdr(holds_address, &search) == 1 ? 0 : -1;
}
