#pragma once
// Attributes and columns of an HDF5 file that may have been cut short, altered or made by somebody
// else.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/storage/dataset/hdf5_handle.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::hdf5 {

/// A file being read. The first failure is kept and makes every later call return an empty value,
/// so that a sequence of reads is checked once, with status(). Types and sizes are checked before
/// memory is taken.
class Reader {
 public:
  static constexpr const char* damaged_column = "the column is damaged";

  /// Errors: not_found, parse (no HDF5 file), corrupt (cut short).
  static Result<Reader> open(const std::filesystem::path& path);

  std::string text_attribute(const char* object, const char* name);
  double real_attribute(const char* object, const char* name);
  std::uint64_t integer_attribute(const char* object, const char* name);

  /// Numbers of exactly this type; `width` as for Writer::column.
  template <class Number>
  std::vector<Number> column(const char* name, std::size_t width = 0) {
    const std::optional<Column> found =
        open_column(name, std::is_same_v<Number, double> ? H5T_FLOAT : H5T_INTEGER, width);
    if (!found || !require(found->item_bytes == sizeof(Number), name, "numbers of another size"))
      return {};
    std::vector<Number> values(found->items);
    read_into(*found, name, native_type<Number>(), values.data());
    return values;
  }
  std::vector<std::string> texts(const char* name);
  std::string document(const char* name);

  /// Whether the file has a group or column of this name; its parents must exist.
  bool has(const char* name);
  bool has_attribute(const char* object, const char* name);
  /// Whether a column holds whole numbers; and the second extent of a two-dimensional one.
  bool is_integer(const char* name);
  std::size_t text_width(const char* name);

  /// Whether these rows of a column can be read; of a column whose shape was checked.
  bool can_read(const char* name, std::uint64_t first, std::uint64_t rows);
  [[nodiscard]] std::uint64_t rows_of(const char* name);

  /// Notes Errc::corrupt at `where` unless `fine`.
  bool require(bool fine, const char* where, const char* what);
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  struct Column {
    Handle handle;
    std::size_t items = 0;
    std::size_t item_bytes = 0;
  };
  std::optional<Column> open_column(const char* name, H5T_class_t type_class, std::size_t width);
  void read_into(const Column& column, const char* name, hid_t type, void* values);

  Handle file_;
  Status status_;
};

}  // namespace weft::daemon::hdf5
