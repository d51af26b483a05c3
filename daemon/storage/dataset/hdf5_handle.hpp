#pragma once
// HDF5's integer handles as objects that close themselves, and its errors as values.

#include <hdf5.h>

#include <cstdint>
#include <mutex>
#include <string>
#include <type_traits>
#include <utility>

namespace weft::daemon::hdf5 {

// What the writer and the reader of a data set file agree on (docs/dataset.md, "HDF5 layout").

constexpr const char* format_name = "weft-dataset";
constexpr std::uint32_t format_version = 1;

/// Longest text in a table column or attribute: names and labels, not documents.
constexpr std::size_t max_text_bytes = 4096;
/// Documents (recipe, rig, device identities) have a data set each.
constexpr std::size_t max_document_bytes = std::size_t{64} << 20;

/// Owns one handle. Every HDF5 object type has a close function of its own.
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
  /// False when closing failed: for a file, that not everything reached the disk.
  bool close() { return id_ < 0 || close_(std::exchange(id_, -1)) >= 0; }

 private:
  hid_t id_ = -1;
  Close close_ = nullptr;
};

/// Reads and writes of a whole column: H5S_ALL, whose macro holds an old-style cast.
constexpr hid_t whole_column = 0;

/// A library that was built without threads has global state: one thread at a time is in it.
/// Debian's (1.10.8) was built with them (H5is_library_threadsafe) and would do without. Made
/// before any handle, and gone after them.
inline std::recursive_mutex& library() {
  static std::recursive_mutex one;
  return one;
}

/// Stops HDF5 from printing while in scope: failures are reported by Result. Other threads wait
/// with their HDF5 work until it is gone. To be made before any other HDF5 call, because the
/// library loses objects of damaged files and would complain of them when the process ends; handles
/// here close themselves, so that it has nothing to tidy up then.
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

/// The type of `Number` in memory.
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

}  // namespace weft::daemon::hdf5
