#pragma once
// HDF5 for data sets: handles that close themselves, the library's lock, its errors as values, and
// Writer and Reader of columns, attributes and documents.

#include <hdf5.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "protocols/base/bytes.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::hdf5 {

// Constants shared by the writer and the reader of a data set file (docs/reference/dataset.md,
// "HDF5 layout").

constexpr const char* format_name = "weft-dataset";
constexpr std::uint32_t format_version = 1;

/// Longest text in a table column or attribute: names and labels, not documents.
constexpr std::size_t max_text_bytes = 4096;
/// Documents (recipe, rig, device identities) are stored as one HDF5 data set each.
constexpr std::size_t max_document_bytes = std::size_t{64} << 20;

/// Owns one handle. Every HDF5 object type has its own close function.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Handle() = default;
  Handle(hid_t id, Close closer) : id_(id), close_(closer) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    if (this != &other) {
      close();
      id_ = std::exchange(other.id_, -1);
      close_ = other.close_;
    }
    return *this;
  }
  ~Handle() { close(); }

  [[nodiscard]] bool ok() const { return id_ >= 0; }
  [[nodiscard]] hid_t id() const { return id_; }
  /// False if closing failed: a file is then not completely on the disk.
  bool close() { return id_ < 0 || close_(std::exchange(id_, -1)) >= 0; }

 private:
  hid_t id_ = -1;
  Close close_ = nullptr;
};

/// H5S_ALL (reads or writes a whole column), without its macro, which contains an old-style cast.
constexpr hid_t whole_column = 0;

/// Lock of the HDF5 library: without thread support it has global state, so only one thread may use
/// it. Debian's build (1.10.8) has thread support (H5is_library_threadsafe) and would not need the
/// lock. Create it before any handle and destroy it after all of them.
inline std::recursive_mutex& library() {
  static std::recursive_mutex one;
  return one;
}

/// Keeps HDF5 from printing while in scope: failures are reported by Result. Other threads wait
/// with their HDF5 work until it is destroyed. Create it before any other HDF5 call: the library
/// loses objects of damaged files and would complain about them at process exit. Handles here close
/// themselves, so the library's exit handler is not needed.
class QuietErrors {
 public:
  QuietErrors() : alone_(library()) {
    H5dont_atexit();
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  QuietErrors(const QuietErrors&) = delete;
  QuietErrors& operator=(const QuietErrors&) = delete;
  ~QuietErrors() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }

 private:
  const std::lock_guard<std::recursive_mutex> alone_;
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

/// The innermost message of HDF5's error stack, which names the cause.
inline std::string last_error() {
  std::string text;
  const auto visit = [](unsigned, const H5E_error2_t* error, void* out) -> herr_t {
    if (error->desc != nullptr) *static_cast<std::string*>(out) = error->desc;
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, visit, &text);
  return text;
}

/// The HDF5 type of `Number` in memory.
template <class Number>
hid_t native_type() {
  if constexpr (std::is_same_v<Number, std::uint8_t>) {
    return H5T_NATIVE_UINT8;
  } else if constexpr (std::is_same_v<Number, std::uint16_t>) {
    return H5T_NATIVE_UINT16;
  } else if constexpr (std::is_same_v<Number, std::uint32_t>) {
    return H5T_NATIVE_UINT32;
  } else if constexpr (std::is_same_v<Number, std::uint64_t>) {
    return H5T_NATIVE_UINT64;
  } else if constexpr (std::is_same_v<Number, std::int32_t>) {
    return H5T_NATIVE_INT32;
  } else if constexpr (std::is_same_v<Number, std::int64_t>) {
    return H5T_NATIVE_INT64;
  } else {
    static_assert(std::is_same_v<Number, double>);
    return H5T_NATIVE_DOUBLE;
  }
}

/// Collects one value of every item.
template <class Item, class Value>
auto gather(const std::vector<Item>& items, Value value) {
  std::vector<std::remove_cvref_t<std::invoke_result_t<Value, const Item&>>> column;
  column.reserve(items.size());
  for (const Item& item : items) column.push_back(std::invoke(value, item));
  return column;
}

/// Concatenates the lists of all items.
template <class Item, class List>
auto concatenate(const std::vector<Item>& items, List list) {
  std::remove_cvref_t<std::invoke_result_t<List, const Item&>> all;
  std::size_t total = 0;
  for (const Item& item : items) total += std::invoke(list, item).size();
  all.reserve(total);
  for (const Item& item : items) {
    const auto& own = std::invoke(list, item);
    all.insert(all.end(), own.begin(), own.end());
  }
  return all;
}

class Writer;

/// A column that is written while its length is not known yet. Rows are packed and written in whole
/// chunks, so that little of the column is in memory. A column shorter than `kept_bytes` has the
/// same layout as one of Writer::column().
class GrowingColumn {
 public:
  static constexpr std::size_t kept_bytes = std::size_t{1} << 20;

  /// `width` as in Writer::column.
  template <class Number>
  static GrowingColumn of(std::string name, std::size_t width = 0) {
    return {std::move(name), native_type<Number>(), width, sizeof(Number)};
  }

  template <class Number>
  void add(Writer& out, const std::vector<Number>& values) {
    add_bytes(out, {reinterpret_cast<const std::uint8_t*>(values.data()),
                    values.size() * sizeof(Number)});
  }
  /// Writes the rest. Call once, after the last row; attributes are possible afterwards.
  void finish(Writer& out);

 private:
  GrowingColumn(std::string name, hid_t type, std::size_t width, std::size_t item_bytes)
      : name_(std::move(name)), type_(type), width_(width), item_bytes_(item_bytes) {}
  void add_bytes(Writer& out, ByteView rows);
  void write(Writer& out, ByteView rows);

  std::string name_;
  hid_t type_;
  std::size_t width_, item_bytes_;
  Handle column_;           ///< created with the first chunks
  std::uint64_t rows_ = 0;  ///< written
  Bytes waiting_;
};

/// A file or group being written. The first failure is kept and makes every later call a no-op, so
/// a sequence of writes is checked once, at its end.
class Writer {
 public:
  static Writer create(const std::filesystem::path& path);

  /// Creates a group; its parents must exist. Names start with "/".
  void group(const std::string& name);
  /// `object`: a group or column. Text is fixed-length UTF-8.
  void attribute(const std::string& object, const std::string& name, std::string_view text);
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void attribute(const std::string& object, const std::string& name, Number value) {
    write_attribute(object, name, native_type<Number>(), &value);
  }

  /// A column of rows x `width` numbers, chunked, shuffled and deflated. `width` 0:
  /// one-dimensional.
  template <class Number>
  void column(const std::string& name, const std::vector<Number>& values, std::size_t width = 0) {
    write_column(name, native_type<Number>(), values.data(), values.size(), width, sizeof(Number));
  }
  /// Fixed-length strings as wide as the longest, padded with zero bytes.
  void column(const std::string& name, const std::vector<std::string>& texts);
  /// Writes one long text.
  void document(const std::string& name, std::string_view text);

  /// The first failure, if any.
  [[nodiscard]] const Status& status() const { return status_; }
  /// Closes the file and returns the first failure, if any.
  Status close();

 private:
  friend class GrowingColumn;
  Writer() = default;
  bool failed() const { return !status_.has_value(); }
  /// Records a failure unless `fine`.
  bool require(bool fine, const char* what);
  void write_attribute(const std::string& object, const std::string& name, hid_t type,
                       const void* value);
  void write_column(const std::string& name, hid_t type, const void* values, std::size_t count,
                    std::size_t width, std::size_t item_bytes);

  Handle file_;
  Status status_;
};

/// A column that is read in slices of rows and stays open between them.
struct SlicedColumn {
  std::string name{};
  Handle handle{};
  std::uint64_t rows = 0;
  std::size_t width = 0;  ///< as in Writer::column
};

/// A file being read. The first failure is kept and makes every later call return an empty value,
/// so a sequence of reads is checked once, with status(). Types and sizes are checked before memory
/// is allocated.
class Reader {
 public:
  static constexpr const char* damaged_column = "column damaged";

  /// Errors: not_found, parse (not HDF5), corrupt (truncated), busy.
  static Result<Reader> open(const std::filesystem::path& path);

  std::string text_attribute(const std::string& object, const std::string& name);
  double real_attribute(const std::string& object, const std::string& name);
  std::uint64_t integer_attribute(const std::string& object, const std::string& name);

  /// Numbers of exactly this type, or texts; `width` as in Writer::column.
  template <class Value>
  std::vector<Value> column(const std::string& name, std::size_t width = 0) {
    if constexpr (std::is_same_v<Value, std::string>) {
      return texts(name);
    } else {
      const std::optional<Column> found =
          open_column(name, std::is_same_v<Value, double> ? H5T_FLOAT : H5T_INTEGER, width);
      if (!found || !require(found->item_bytes == sizeof(Value), name,
                             "column has numbers of the wrong size"))
        return {};
      std::vector<Value> values(found->items);
      read_into(*found, name, native_type<Value>(), values.data());
      return values;
    }
  }
  /// The same for a column that slice() reads.
  template <class Number>
  SlicedColumn sliced(const std::string& name, std::size_t width = 0) {
    std::optional<Column> found =
        open_column(name, std::is_same_v<Number, double> ? H5T_FLOAT : H5T_INTEGER, width);
    if (!found ||
        !require(found->item_bytes == sizeof(Number), name, "column has numbers of the wrong size"))
      return {name};
    return {name, std::move(found->handle), found->items / std::max<std::size_t>(width, 1), width};
  }
  /// Some rows of a column; they must lie within it.
  template <class Number>
  std::vector<Number> slice(const SlicedColumn& column, std::uint64_t first, std::uint64_t rows) {
    if (!status_ || rows == 0) return {};
    std::vector<Number> values(rows * std::max<std::size_t>(column.width, 1));
    read_slice(column, first, rows, native_type<Number>(), values.data());
    return values;
  }
  std::vector<std::string> texts(const std::string& name);
  std::string document(const std::string& name);

  /// True if the file has a group or column of this name; its parents must exist.
  bool has(const std::string& name);
  bool has_attribute(const std::string& object, const std::string& name);
  /// is_integer(): true if a column holds whole numbers. text_width(): the second extent of a
  /// two-dimensional column.
  bool is_integer(const std::string& name);
  std::size_t text_width(const std::string& name);

  /// True if these rows of a column can be read. The column's shape must have been checked.
  bool can_read(const std::string& name, std::uint64_t first, std::uint64_t rows);
  [[nodiscard]] std::uint64_t rows_of(const std::string& name);

  /// Records Errc::corrupt at `where` unless `fine`.
  bool require(bool fine, std::string_view where, std::string_view what);
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  struct Column {
    Handle handle;
    std::size_t items = 0;
    std::size_t item_bytes = 0;
  };
  /// Records Errc::unsupported if this build cannot unpack the column.
  void require_filters(const Handle& column, const std::string& name);
  std::optional<Column> open_column(const std::string& name, H5T_class_t type_class,
                                    std::size_t width);
  void read_number(const std::string& object, const std::string& name, hid_t type, void* value,
                   std::string_view complaint);
  void read_slice(const SlicedColumn& column, std::uint64_t first, std::uint64_t rows, hid_t type,
                  void* values);
  void read_into(const Column& column, const std::string& name, hid_t type, void* values);

  Handle file_;
  Status status_;
};

}  // namespace weft::daemon::hdf5
