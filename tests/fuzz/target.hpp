#pragma once
// Shared code of the fuzz targets. Each target is one entry point, the same for libFuzzer (clang)
// and for the replay in the ordinary test suite (any compiler).

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <span>
#include <string>

namespace weft::fuzz {

/// Any bytes are valid input. Returns 0; ends the process when an invariant of the product is
/// violated.
using Target = int (*)(const std::uint8_t* data, std::size_t size);
/// The targets of the replay, by name.
std::map<std::string, Target>& targets();
inline bool add_target(const char* name, Target target) {
  return targets().emplace(name, target).second;
}

/// Ends the process: the invariant `what` does not hold for this input.
inline void demand(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

/// A file in memory with a path, for readers that open files.
class MemoryFile {
 public:
  explicit MemoryFile(std::span<const std::uint8_t> bytes) : fd_(memfd_create("weft-fuzz", 0)) {
    std::size_t done = 0;
    while (fd_ >= 0 && done < bytes.size()) {
      const ssize_t written = ::write(fd_, bytes.data() + done, bytes.size() - done);
      demand(written > 0, "the fuzz target can write its own file");
      done += static_cast<std::size_t>(written);
    }
    demand(fd_ >= 0, "the fuzz target can make its own file");
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { ::close(fd_); }

  [[nodiscard]] std::filesystem::path path() const {
    return "/proc/self/fd/" + std::to_string(fd_);
  }

 private:
  int fd_;
};

}  // namespace weft::fuzz

// Opens the entry point of a target: `data` and `size` are the input.
#ifdef WEFT_LIBFUZZER
#define WEFT_FUZZ_TARGET(name) \
  extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
#else
#define WEFT_FUZZ_TARGET(name)                                                  \
  static int run_##name(const std::uint8_t* data, std::size_t size);            \
  static const bool added_##name = ::weft::fuzz::add_target(#name, run_##name); \
  static int run_##name(const std::uint8_t* data, std::size_t size)
#endif
