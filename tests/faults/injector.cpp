// SPDX-License-Identifier: Apache-2.0
// Preloaded into a program, makes one of its calls fail. Counted are calls that concern files below
// FAULT_ROOT, or with FAULT_KIND=ALLOC all allocations between the begin and the end of main().
//
//   FAULT_ROOT    folder (absolute); other files are left alone
//   FAULT_KIND    ENOSPC, EIO, EINTR: the call fails with it; SHORT: it does half of what it
//   should;
//                 ALLOC: the allocation fails, or the next that a library bears
//   FAULT_CALL    which call fails, from 1; 0: none
//   FAULT_LOG     file that takes a line "NUMBER CALL PATH" for each call (FAULT_CALL=0) or for the
//                 one that fails; for ALLOC with FAULT_CALL=0 only their number
#include <dirent.h>
#include <dlfcn.h>
#include <execinfo.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
}

namespace {

constexpr int kMostDescriptors = 4096;

struct Settings {
  std::string_view root, kind;
  const char* log = nullptr;
  long call = 0;
  char* dlopen = nullptr;  // where its code begins
};
Settings settings;
std::atomic<long> calls = 0, allocations = 0;
std::atomic<bool> in_main = false;
std::array<std::atomic<bool>, kMostDescriptors> watched{};

void log_line(long number, const char* call, const char* path) {
  if (settings.log == nullptr) return;
  char line[700];
  const int length = std::snprintf(line, sizeof line, "%ld %s %.500s\n", number, call,
                                   path == nullptr ? "" : path);
  const long file =
      syscall(SYS_openat, AT_FDCWD, settings.log, O_WRONLY | O_CREAT | O_APPEND, 0666);
  if (file < 0) return;
  syscall(SYS_write, file, line, length);
  syscall(SYS_close, file);
}

bool is_watched(int descriptor) {
  return descriptor >= 0 && descriptor < kMostDescriptors && watched[descriptor];
}

int watch(int descriptor) {
  if (descriptor >= 0 && descriptor < kMostDescriptors) watched[descriptor] = true;
  return descriptor;
}

bool below_root(const char* path) {
  return path != nullptr && !settings.root.empty() &&
         std::string_view(path).starts_with(settings.root);
}

// Counts the call; true, with errno, when it is the one to fail.
bool fails(const char* call, const char* path) {
  if (!in_main || settings.kind == "ALLOC") return false;
  const long number = ++calls;
  if (settings.call == 0) log_line(number, call, path);
  if (number != settings.call) return false;
  log_line(number, call, path);
  errno = settings.kind == "ENOSPC" ? ENOSPC : settings.kind == "EINTR" ? EINTR : EIO;
  return settings.kind != "SHORT";
}

// As fails(); a SHORT call is made with half the count.
bool fails(const char* call, int descriptor, std::size_t& count) {
  if (!is_watched(descriptor)) return false;
  const bool failed = fails(call, "");
  if (settings.kind == "SHORT" && settings.call != 0 && calls == settings.call && count > 1) {
    count /= 2;
  }
  return failed;
}

// FFmpeg, OpenCV's part around it, and GDAL, which OpenCV starts with the first image, read through
// the null pointers that they get, or end the program themselves; so does libstdc++ in the listing
// of a folder, which allocates where nothing may be thrown, and the loader, or a library that it
// starts, during dlopen(), which has a hundred thousand allocations. How many are passed over; 0:
// this one may fail.
long passed_over() {
  constexpr long kMany = 1000;
  constexpr std::ptrdiff_t kLongestFunction = 256;
  constexpr std::array<std::string_view, 5> kFragile{"libav", "libsw", "libx264", "videoio",
                                                     "libgdal"};
  std::array<void*, 40> callers{};
  const int count = backtrace(callers.data(), static_cast<int>(callers.size()));
  // Asked first: meanwhile the loader cannot say what an address belongs to.
  for (int i = 0; i < count; ++i) {
    const std::ptrdiff_t into = static_cast<char*>(callers[i]) - settings.dlopen;
    if (into > 0 && into < kLongestFunction) return kMany;
  }
  for (int i = 0; i < count; ++i) {
    Dl_info info{};
    if (dladdr(callers[i], &info) == 0 || info.dli_fname == nullptr) continue;
    const std::string_view library = info.dli_fname;
    const std::string_view function = info.dli_sname == nullptr ? "" : info.dli_sname;
    if (function.find("directory_iterator") != std::string_view::npos) return 1;
    for (const std::string_view fragile : kFragile) {
      if (library.find(fragile) != std::string_view::npos) return 1;
    }
  }
  return 0;
}

bool allocation_fails() {
  if (!in_main || settings.kind != "ALLOC") return false;
  const long number = ++allocations;
  static std::atomic<long> wanted = settings.call;
  if (number != wanted) return false;
  if (const long more = passed_over(); more > 0) {  // behind its own allocations, which count
    wanted = allocations + more;
    return false;
  }
  log_line(number, "malloc", "");
  errno = ENOMEM;
  return true;
}

template <typename Function>
Function* next(Function*, const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

int (*program)(int, char**, char**) = nullptr;

int observed_main(int argc, char** argv, char** environment) {
  const auto text = [](const char* name) {
    const char* value = std::getenv(name);
    return value == nullptr ? "" : value;
  };
  settings.root = text("FAULT_ROOT");
  settings.kind = text("FAULT_KIND");
  settings.log = std::getenv("FAULT_LOG");
  settings.call = std::atol(text("FAULT_CALL"));
  settings.dlopen = static_cast<char*>(dlsym(RTLD_DEFAULT, "dlopen"));
  void* caller = nullptr;
  backtrace(&caller, 1);  // loads what it needs, which it must not do while something is loaded
  in_main = true;
  const int result = program(argc, argv, environment);
  in_main = false;
  if (settings.kind == "ALLOC" && settings.call == 0) log_line(allocations, "malloc", "");
  return result;
}

}  // namespace

#define NEXT(function) static const auto real = next(&function, #function)

extern "C" {

int __libc_start_main(int (*main)(int, char**, char**), int argc, char** argv, void (*init)(),
                      void (*fini)(), void (*rtld_fini)(), void* stack_end) {
  program = main;
  NEXT(__libc_start_main);
  return real(observed_main, argc, argv, init, fini, rtld_fini, stack_end);
}

void* malloc(std::size_t size) { return allocation_fails() ? nullptr : __libc_malloc(size); }
void* calloc(std::size_t count, std::size_t size) {
  return allocation_fails() ? nullptr : __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  return allocation_fails() ? nullptr : __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return allocation_fails() ? nullptr : __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  if (allocation_fails()) return ENOMEM;
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}

#define OPEN(name)                                         \
  int name(const char* path, int flags, ...) {             \
    va_list arguments;                                     \
    va_start(arguments, flags);                            \
    const mode_t mode = va_arg(arguments, mode_t);         \
    va_end(arguments);                                     \
    NEXT(name);                                            \
    if (!below_root(path)) return real(path, flags, mode); \
    if (fails("open", path)) return -1;                    \
    return watch(real(path, flags, mode));                 \
  }
OPEN(open)
OPEN(open64)

#define OPENAT(name)                                               \
  int name(int folder, const char* path, int flags, ...) {         \
    va_list arguments;                                             \
    va_start(arguments, flags);                                    \
    const mode_t mode = va_arg(arguments, mode_t);                 \
    va_end(arguments);                                             \
    NEXT(name);                                                    \
    if (!below_root(path)) return real(folder, path, flags, mode); \
    if (fails("open", path)) return -1;                            \
    return watch(real(folder, path, flags, mode));                 \
  }
OPENAT(openat)
OPENAT(openat64)

#define FOPEN(name)                                     \
  std::FILE* name(const char* path, const char* mode) { \
    NEXT(name);                                         \
    if (!below_root(path)) return real(path, mode);     \
    if (fails("open", path)) return nullptr;            \
    std::FILE* file = real(path, mode);                 \
    if (file != nullptr) watch(fileno(file));           \
    return file;                                        \
  }
FOPEN(fopen)
FOPEN(fopen64)

int close(int descriptor) {
  NEXT(close);
  if (descriptor >= 0 && descriptor < kMostDescriptors) watched[descriptor] = false;
  return real(descriptor);
}
int fclose(std::FILE* file) {
  NEXT(fclose);
  const int descriptor = fileno(file);
  if (descriptor >= 0 && descriptor < kMostDescriptors) watched[descriptor] = false;
  return real(file);
}

ssize_t read(int descriptor, void* bytes, std::size_t count) {
  NEXT(read);
  return fails("read", descriptor, count) ? -1 : real(descriptor, bytes, count);
}
ssize_t pread(int descriptor, void* bytes, std::size_t count, off_t offset) {
  NEXT(pread);
  return fails("read", descriptor, count) ? -1 : real(descriptor, bytes, count, offset);
}
ssize_t pread64(int descriptor, void* bytes, std::size_t count, off64_t offset) {
  NEXT(pread64);
  return fails("read", descriptor, count) ? -1 : real(descriptor, bytes, count, offset);
}
ssize_t write(int descriptor, const void* bytes, std::size_t count) {
  NEXT(write);
  return fails("write", descriptor, count) ? -1 : real(descriptor, bytes, count);
}
std::size_t fread(void* bytes, std::size_t size, std::size_t count, std::FILE* file) {
  NEXT(fread);
  if (is_watched(fileno(file)) && fails("fread", "")) return 0;
  return real(bytes, size, count, file);
}
std::size_t fwrite(const void* bytes, std::size_t size, std::size_t count, std::FILE* file) {
  NEXT(fwrite);
  if (is_watched(fileno(file)) && fails("fwrite", "")) return 0;
  return real(bytes, size, count, file);
}

#define ON_DESCRIPTOR(name)                                                    \
  int name(int descriptor) {                                                   \
    NEXT(name);                                                                \
    return is_watched(descriptor) && fails(#name, "") ? -1 : real(descriptor); \
  }
ON_DESCRIPTOR(fsync)
ON_DESCRIPTOR(fdatasync)

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"  // there is also a struct flock
int flock(int descriptor, int operation) {
  NEXT(flock);
  return is_watched(descriptor) && fails("flock", "") ? -1 : real(descriptor, operation);
}
#pragma GCC diagnostic pop
int fchmod(int descriptor, mode_t mode) {
  NEXT(fchmod);
  return is_watched(descriptor) && fails("fchmod", "") ? -1 : real(descriptor, mode);
}
int ftruncate(int descriptor, off_t size) {
  NEXT(ftruncate);
  return is_watched(descriptor) && fails("ftruncate", "") ? -1 : real(descriptor, size);
}
int ftruncate64(int descriptor, off64_t size) {
  NEXT(ftruncate64);
  return is_watched(descriptor) && fails("ftruncate", "") ? -1 : real(descriptor, size);
}
int fstat(int descriptor, struct stat* status) {
  NEXT(fstat);
  return is_watched(descriptor) && fails("stat", "") ? -1 : real(descriptor, status);
}
int stat(const char* path, struct stat* status) {
  NEXT(stat);
  return below_root(path) && fails("stat", path) ? -1 : real(path, status);
}
int lstat(const char* path, struct stat* status) {
  NEXT(lstat);
  return below_root(path) && fails("stat", path) ? -1 : real(path, status);
}
int fstat64(int descriptor, struct stat64* status) {
  NEXT(fstat64);
  return is_watched(descriptor) && fails("stat", "") ? -1 : real(descriptor, status);
}
int stat64(const char* path, struct stat64* status) {
  NEXT(stat64);
  return below_root(path) && fails("stat", path) ? -1 : real(path, status);
}
int lstat64(const char* path, struct stat64* status) {
  NEXT(lstat64);
  return below_root(path) && fails("stat", path) ? -1 : real(path, status);
}
int rename(const char* from, const char* to) {
  NEXT(rename);
  return below_root(from) && fails("rename", to) ? -1 : real(from, to);
}
int mkdir(const char* path, mode_t mode) {
  NEXT(mkdir);
  return below_root(path) && fails("mkdir", path) ? -1 : real(path, mode);
}
DIR* opendir(const char* path) {
  NEXT(opendir);
  return below_root(path) && fails("opendir", path) ? nullptr : real(path);
}
void* mmap(void* address, std::size_t size, int protection, int flags, int descriptor,
           off_t offset) {
  NEXT(mmap);
  if (is_watched(descriptor) && fails("mmap", "")) return MAP_FAILED;
  return real(address, size, protection, flags, descriptor, offset);
}

}  // extern "C"
