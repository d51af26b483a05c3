#pragma once
// Groups, attributes and columns of a new HDF5 file.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/storage/dataset/hdf5_handle.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::hdf5 {

/// A file or group being written. The first failure is kept and makes every later call a no-op, so
/// that a sequence of writes is checked once, at its end.
class Writer {
 public:
  static Writer create(const std::filesystem::path& path, int deflate_level);

  /// A group of this file; parents must exist. Names start with "/".
  void group(const char* name);
  /// `object`: a group or column. Text is fixed-length UTF-8.
  void attribute(const char* object, const char* name, std::string_view text);
  void attribute(const char* object, const char* name, double value);
  void attribute(const char* object, const char* name, std::uint64_t value);
  void attribute(const char* object, const char* name, std::uint32_t value);

  /// A column of rows x `width` numbers, chunked, shuffled and deflated. `width` 0:
  /// one-dimensional.
  template <class Number>
  void column(const char* name, const std::vector<Number>& values, std::size_t width = 0) {
    write_column(name, native_type<Number>(), values.data(), values.size(), width, sizeof(Number));
  }
  /// Fixed-length strings as wide as the longest, padded with zero bytes.
  void column(const char* name, const std::vector<std::string>& texts);
  /// One long text.
  void document(const char* name, std::string_view text);

  /// Closes the file. The first failure of all, if any.
  Status close();

 private:
  explicit Writer(int deflate_level) : deflate_level_(deflate_level) {}
  bool failed() const { return !status_.has_value(); }
  /// Notes a failure unless `fine`.
  bool require(bool fine, const char* what);
  void write_attribute(const char* object, const char* name, hid_t type, const void* value);
  void write_column(const char* name, hid_t type, const void* values, std::size_t count,
                    std::size_t width, std::size_t item_bytes);

  Handle file_;
  int deflate_level_;
  Status status_;
};

}  // namespace weft::daemon::hdf5
