#pragma once
// What the fuzz targets share. Each target is one entry point, the same for libFuzzer (clang) and
// for the replay in the ordinary test suite (any compiler).

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <string>

/// Any bytes are an input. Returns 0; ends the process when a promise of the product is broken.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace weft::fuzz {

/// Ends the process: the promise `what` does not hold for this input.
inline void demand(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

/// A file that lives in memory and has a path, for readers that open files.
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
