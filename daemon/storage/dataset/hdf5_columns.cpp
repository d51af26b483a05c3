#include "daemon/storage/dataset/hdf5_columns.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <string_view>

#include "daemon/base/file/file_holders.hpp"
#include "daemon/base/file/file_kind.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/dataset/hdf5_pack.hpp"

namespace weft::daemon::hdf5 {
namespace {

/// Large enough for deflate to find repetitions, small enough for partial reads.
constexpr std::size_t chunk_bytes = std::size_t{256} << 10;
/// Higher levels gain little on shuffled counts.
constexpr int deflate_level = 1;
/// H5S_UNLIMITED, without its macro, which contains an old-style cast.
constexpr hsize_t unlimited = std::numeric_limits<hsize_t>::max();
/// Number of chunks packed at once, so that a long column is never copied as a whole.
constexpr std::size_t packed_at_once = 64;

Handle text_type(std::size_t bytes) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), std::max<std::size_t>(bytes, 1));  // HDF5 has no string of size 0
  H5Tset_strpad(type.id(), H5T_STR_NULLPAD);
  H5Tset_cset(type.id(), H5T_CSET_UTF8);
  return type;
}

/// Rows and columns of a chunk.
std::array<hsize_t, 2> chunk_size(hsize_t rows, hsize_t width, std::size_t item_bytes) {
  const hsize_t columns = std::max<hsize_t>(width, 1);
  const hsize_t fitting = std::max<hsize_t>(1, chunk_bytes / (columns * item_bytes));
  return {std::min(rows, fitting), columns};
}

/// Creation properties of a file (its root group), a group or a column. Without time stamps, equal
/// content gives equal bytes.
Handle timeless_properties(hid_t kind) {
  Handle properties(H5Pcreate(kind), H5Pclose);
  H5Pset_obj_track_times(properties.id(), 0);
  return properties;
}

/// `rows`: 0 for a column without chunks.
Handle column_properties(hsize_t rows, hsize_t width, std::size_t item_bytes) {
  Handle properties = timeless_properties(H5P_DATASET_CREATE);
  if (rows == 0) return properties;
  const auto chunk = chunk_size(rows, width, item_bytes);
  H5Pset_chunk(properties.id(), width == 0 ? 1 : 2, chunk.data());
  H5Pset_shuffle(properties.id());
  H5Pset_deflate(properties.id(), deflate_level);
  return properties;
}

/// Writes chunks that are already packed: the library would pack them on one core. `first`: row of
/// the first chunk.
bool write_chunks(const Handle& column, ByteView rows, const std::array<hsize_t, 2>& size,
                  std::size_t item_bytes, hsize_t first = 0) {
  const std::size_t bytes = size[0] * size[1] * item_bytes;
  std::array<hsize_t, 2> at{first, 0};
  for (; !rows.empty(); rows = rows.subspan(std::min(rows.size(), packed_at_once * bytes))) {
    const ByteView some = rows.first(std::min(rows.size(), packed_at_once * bytes));
    for (const Bytes& chunk : pack_chunks(some, {bytes, item_bytes, deflate_level})) {
      if (chunk.empty() ||
          H5Dwrite_chunk(column.id(), H5P_DEFAULT, 0, at.data(), chunk.size(), chunk.data()) < 0)
        return false;
      at[0] += size[0];
    }
  }
  return true;
}

/// Deflate cannot shrink by more than about 1032 to 1. A column that claims more is damaged and
/// would only use up memory.
constexpr std::uint64_t max_inflation = 1100;

/// Removes the padding of fixed-length strings.
std::string unpadded(std::string_view text) {
  return std::string(text.substr(0, text.find('\0')));
}

Handle open_attribute(const Handle& file, const std::string& object, const std::string& name) {
  return {H5Aopen_by_name(file.id(), object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT),
          H5Aclose};
}

/// True for one text of fixed length, at most `most_bytes`.
bool is_text(const Handle& type, const Handle& space, std::size_t most_bytes) {
  return H5Tget_class(type.id()) == H5T_STRING && H5Tis_variable_str(type.id()) == 0 &&
         H5Tget_size(type.id()) <= most_bytes && H5Sget_simple_extent_npoints(space.id()) == 1;
}

/// A column of a file. If it cannot be opened, no further HDF5 function is called, so that HDF5
/// keeps the cause.
struct OpenColumn {
  OpenColumn(const Handle& file, const std::string& name)
      : handle(H5Dopen2(file.id(), name.c_str(), H5P_DEFAULT), H5Dclose),
        type(handle.ok() ? H5Dget_type(handle.id()) : -1, H5Tclose),
        space(handle.ok() ? H5Dget_space(handle.id()) : -1, H5Sclose) {}

  /// Returns the number of dimensions; fills `size` if it is one or two.
  int read_size(std::array<hsize_t, 2>& size) const {
    const int dimensions = H5Sget_simple_extent_ndims(space.id());
    if (dimensions == 1 || dimensions == 2)
      H5Sget_simple_extent_dims(space.id(), size.data(), nullptr);
    return dimensions;
  }

  Handle handle, type, space;
};

/// Allows opening files on file systems without locks (some network shares).
void allow_without_locks(const Handle& access) {
  H5Pset_file_locking(access.id(), true, true);
}

Error in_use(const std::filesystem::path& path) {
  const std::string holders = file_holders({path});
  return {.code = Errc::busy,
          .where = path.string(),
          .what = "file in use by another program",
          .expected = "no lock",
          .got = holders.empty() ? "locked by an unknown program" : "locked by " + holders,
          .hint = "Close the file in that program and try again"};
}

}  // namespace

Writer Writer::create(const std::filesystem::path& path) {
  Writer writer;
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  // The 1.10 layout has checksums on its own structures; h5py 2.7 (2017) and later read it.
  H5Pset_libver_bounds(access.id(), H5F_LIBVER_V110, H5F_LIBVER_V110);
  allow_without_locks(access);
  const Handle properties = timeless_properties(H5P_FILE_CREATE);
  writer.file_ =
      Handle(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, properties.id(), access.id()), H5Fclose);
  writer.require(writer.file_.ok(), "file not created");
  return writer;
}

bool Writer::require(bool fine, const char* what) {
  if (!fine && !failed()) status_ = fail({.code = Errc::io, .what = what, .got = last_error()});
  return fine;
}

void Writer::group(const std::string& name) {
  if (failed()) return;
  const Handle properties = timeless_properties(H5P_GROUP_CREATE);
  const Handle group(
      H5Gcreate2(file_.id(), name.c_str(), H5P_DEFAULT, properties.id(), H5P_DEFAULT), H5Gclose);
  require(group.ok(), "HDF5 group not created");
}

void Writer::write_attribute(const std::string& object, const std::string& name, hid_t type,
                             const void* value) {
  if (failed()) return;
  const Handle owner(H5Oopen(file_.id(), object.c_str(), H5P_DEFAULT), H5Oclose);
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(
      H5Acreate2(owner.id(), name.c_str(), type, space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  require(attribute.ok() && H5Awrite(attribute.id(), type, value) >= 0,
          "HDF5 attribute not written");
}

void Writer::attribute(const std::string& object, const std::string& name, std::string_view text) {
  const std::string padded = text.empty() ? std::string(1, '\0') : as_utf8(text);
  write_attribute(object, name, text_type(padded.size()).id(), padded.data());
}

void Writer::write_column(const std::string& name, hid_t type, const void* values,
                          std::size_t count, std::size_t width, std::size_t item_bytes) {
  if (failed()) return;
  const std::array<hsize_t, 2> size{count / std::max<std::size_t>(width, 1), width};
  const Handle space(H5Screate_simple(width == 0 ? 1 : 2, size.data(), nullptr), H5Sclose);
  const Handle properties = column_properties(size[0], width, item_bytes);
  const Handle column(H5Dcreate2(file_.id(), name.c_str(), type, space.id(), H5P_DEFAULT,
                                 properties.id(), H5P_DEFAULT),
                      H5Dclose);
  if (!require(column.ok(), "HDF5 column not created") || count == 0) return;
  const ByteView rows(static_cast<const std::uint8_t*>(values), count * item_bytes);
  require(write_chunks(column, rows, chunk_size(size[0], width, item_bytes), item_bytes),
          "HDF5 column not written");
}

void Writer::column(const std::string& name, const std::vector<std::string>& texts) {
  std::size_t width = 1;
  for (const std::string& text : texts) width = std::max(width, text.size());
  std::string padded;
  for (const std::string& text : texts) padded += text + std::string(width - text.size(), '\0');
  write_column(name, text_type(width).id(), padded.data(), texts.size(), 0, width);
}

void Writer::document(const std::string& name, std::string_view text) {
  if (failed()) return;
  const std::string padded(text.empty() ? std::string_view("\0", 1) : text);
  const Handle type = text_type(padded.size());
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle properties = column_properties(0, 0, 1);
  const Handle document(H5Dcreate2(file_.id(), name.c_str(), type.id(), space.id(), H5P_DEFAULT,
                                   properties.id(), H5P_DEFAULT),
                        H5Dclose);
  require(document.ok() && H5Dwrite(document.id(), type.id(), whole_column, whole_column,
                                    H5P_DEFAULT, padded.data()) >= 0,
          "HDF5 document not written");
}

void GrowingColumn::add_bytes(Writer& out, ByteView rows) {
  waiting_.insert(waiting_.end(), rows.begin(), rows.end());
  if (waiting_.size() < kept_bytes) return;
  const auto chunk = chunk_size(unlimited, width_, item_bytes_);
  const std::size_t bytes = chunk[0] * chunk[1] * item_bytes_;
  const std::size_t whole = waiting_.size() / bytes * bytes;
  write(out, ByteView(waiting_).first(whole));
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(whole));
}

void GrowingColumn::write(Writer& out, ByteView rows) {
  if (out.failed() || rows.empty()) return;
  const int dimensions = width_ == 0 ? 1 : 2;
  const auto chunk = chunk_size(unlimited, width_, item_bytes_);
  const std::uint64_t count = rows.size() / (chunk[1] * item_bytes_);
  const std::array<hsize_t, 2> size{rows_ + count, width_};
  if (!column_.ok()) {
    const std::array<hsize_t, 2> longest{unlimited, width_};
    const Handle space(H5Screate_simple(dimensions, size.data(), longest.data()), H5Sclose);
    const Handle properties = column_properties(unlimited, width_, item_bytes_);
    column_ = Handle(H5Dcreate2(out.file_.id(), name_.c_str(), type_, space.id(), H5P_DEFAULT,
                                properties.id(), H5P_DEFAULT),
                     H5Dclose);
    if (!out.require(column_.ok(), "HDF5 column not created")) return;
  } else if (!out.require(H5Dset_extent(column_.id(), size.data()) >= 0,
                          "HDF5 column not extended")) {
    return;
  }
  out.require(write_chunks(column_, rows, chunk, item_bytes_, rows_), "HDF5 column not written");
  rows_ += count;
}

void GrowingColumn::finish(Writer& out) {
  if (column_.ok()) {
    write(out, waiting_);
    out.require(column_.close(), "HDF5 column not written");
  } else {
    out.write_column(name_, type_, waiting_.data(), waiting_.size() / item_bytes_, width_,
                     item_bytes_);
  }
  waiting_ = {};
}

Status Writer::close() {
  require(file_.close(), "file not completely written to the disk");
  return status_;
}

Result<Reader> Reader::open(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    return fail({.code = Errc::not_found,
                 .where = path.string(),
                 .what = "folder given instead of a data set file",
                 .hint = "Give the file dataset.h5 in the campaign folder"});
  if (!std::filesystem::is_regular_file(path, ignored))
    return fail(
        {.code = Errc::not_found, .where = path.string(), .what = "data set file not found"});
  if (is_locked_by_another(path)) return tl::unexpected<Error>(in_use(path));
  if (H5Fis_hdf5(path.c_str()) <= 0)
    return fail(with_file_kind(
        {.code = Errc::parse, .where = path.string(), .what = "not an HDF5 file, or truncated"},
        path));
  Reader reader;
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  allow_without_locks(access);
  reader.file_ = Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id()), H5Fclose);
  if (!reader.file_.ok() && is_locked_by_another(path)) return tl::unexpected<Error>(in_use(path));
  if (!reader.file_.ok())
    return fail({.code = Errc::corrupt,
                 .where = path.string(),
                 .what = "HDF5 file truncated or damaged",
                 .got = last_error(),
                 .hint = "Export the data set again"});
  return reader;
}

bool Reader::require(bool fine, std::string_view where, std::string_view what) {
  if (!fine && status_)
    status_ = fail({.code = Errc::corrupt,
                    .where = std::string(where),
                    .what = std::string(what),
                    .got = last_error()});
  return fine;
}

std::string Reader::text_attribute(const std::string& object, const std::string& name) {
  if (!status_) return {};
  const Handle attribute = open_attribute(file_, object, name);
  if (!require(attribute.ok(), name, "attribute missing or damaged")) return {};
  const Handle type(H5Aget_type(attribute.id()), H5Tclose);
  const Handle space(H5Aget_space(attribute.id()), H5Sclose);
  if (!require(is_text(type, space, max_text_bytes), name, "attribute is not a short text"))
    return {};
  std::string text(H5Tget_size(type.id()), '\0');
  require(H5Aread(attribute.id(), type.id(), text.data()) >= 0, name, "attribute not readable");
  return unpadded(text);
}

void Reader::read_number(const std::string& object, const std::string& name, hid_t type,
                         void* value, std::string_view complaint) {
  if (!status_) return;
  const Handle attribute = open_attribute(file_, object, name);
  const Handle space(attribute.ok() ? H5Aget_space(attribute.id()) : -1, H5Sclose);
  require(space.ok() && H5Sget_simple_extent_npoints(space.id()) == 1 &&
              H5Aread(attribute.id(), type, value) >= 0,
          name, complaint);
}

double Reader::real_attribute(const std::string& object, const std::string& name) {
  double value = 0;
  read_number(object, name, H5T_NATIVE_DOUBLE, &value,
              "attribute missing, damaged or not a number");
  return value;
}

std::uint64_t Reader::integer_attribute(const std::string& object, const std::string& name) {
  std::uint64_t value = 0;
  read_number(object, name, H5T_NATIVE_UINT64, &value,
              "attribute missing, damaged or not a whole number");
  return value;
}

void Reader::require_filters(const Handle& column, const std::string& name) {
  const Handle properties(H5Dget_create_plist(column.id()), H5Pclose);
  const int filters = H5Pget_nfilters(properties.id());
  for (int i = 0; status_ && i < filters; ++i) {
    std::array<char, 64> text{};
    std::size_t values = 0;
    unsigned flags = 0, config = 0;
    const H5Z_filter_t filter = H5Pget_filter2(properties.id(), static_cast<unsigned>(i), &flags,
                                               &values, nullptr, text.size(), text.data(), &config);
    if (filter < 0 || H5Zfilter_avail(filter) > 0) continue;
    const std::string called(text.data(), strnlen(text.data(), text.size()));
    status_ = fail({.code = Errc::unsupported,
                    .where = name,
                    .what = "unsupported compression filter",
                    .expected = "gzip (deflate) or no compression",
                    .got = (called.empty() ? "" : as_utf8(called) + ", ") + "HDF5 filter " +
                           std::to_string(filter),
                    .hint = "Convert the file on a computer that has the filter: "
                            "h5repack -f SHUF -f GZIP=1 IN.h5 OUT.h5"});
  }
}

std::optional<Reader::Column> Reader::open_column(const std::string& name, H5T_class_t type_class,
                                                  std::size_t width) {
  if (!status_) return std::nullopt;
  OpenColumn found(file_, name);
  if (!require(found.handle.ok(), name, "column missing or damaged")) return std::nullopt;
  require_filters(found.handle, name);
  if (!status_) return std::nullopt;
  std::array<hsize_t, 2> size{0, 0};
  const bool shaped = found.read_size(size) == (width == 0 ? 1 : 2) && size[1] == width;
  if (!require(shaped && H5Tget_class(found.type.id()) == type_class, name,
               "column has the wrong shape or type"))
    return std::nullopt;
  Column column{std::move(found.handle), 0, H5Tget_size(found.type.id())};
  const std::uint64_t row_bytes = column.item_bytes * std::max<std::size_t>(width, 1);
  const std::uint64_t limit = H5Dget_storage_size(column.handle.id()) * max_inflation;
  if (!require(row_bytes > 0 && size[0] <= limit / row_bytes, name,
               "column longer than its stored data"))
    return std::nullopt;
  column.items = static_cast<std::size_t>(size[0]) * std::max<std::size_t>(width, 1);
  return column;
}

void Reader::read_into(const Column& column, const std::string& name, hid_t type, void* values) {
  if (column.items == 0) return;
  require(H5Dread(column.handle.id(), type, whole_column, whole_column, H5P_DEFAULT, values) >= 0,
          name, damaged_column);
}

void Reader::read_slice(const SlicedColumn& column, std::uint64_t first, std::uint64_t rows,
                        hid_t type, void* values) {
  const std::array<hsize_t, 2> start{first, 0}, count{rows, column.width};
  const Handle space(H5Dget_space(column.handle.id()), H5Sclose);
  H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
  const Handle slice(H5Screate_simple(column.width == 0 ? 1 : 2, count.data(), nullptr), H5Sclose);
  require(H5Dread(column.handle.id(), type, slice.id(), space.id(), H5P_DEFAULT, values) >= 0,
          column.name, damaged_column);
}

std::vector<std::string> Reader::texts(const std::string& name) {
  const std::optional<Column> column = open_column(name, H5T_STRING, 0);
  if (!column) return {};
  const Handle type(H5Dget_type(column->handle.id()), H5Tclose);
  if (!require(H5Tis_variable_str(type.id()) == 0, name, "text column has variable length"))
    return {};
  std::string padded(column->items * column->item_bytes, '\0');
  read_into(*column, name, type.id(), padded.data());
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < column->items; ++i)
    texts.push_back(
        unpadded(std::string_view(padded).substr(i * column->item_bytes, column->item_bytes)));
  return texts;
}

std::string Reader::document(const std::string& name) {
  if (!status_) return {};
  const OpenColumn document(file_, name);
  if (!require(document.handle.ok(), name, "document missing or damaged")) return {};
  require_filters(document.handle, name);
  if (!status_) return {};
  if (!require(is_text(document.type, document.space, max_document_bytes), name,
               "document is not text"))
    return {};
  std::string text(H5Tget_size(document.type.id()), '\0');
  require(H5Dread(document.handle.id(), document.type.id(), whole_column, whole_column, H5P_DEFAULT,
                  text.data()) >= 0,
          name, "document damaged");
  return unpadded(text);
}

bool Reader::has(const std::string& name) {
  return status_.has_value() && H5Lexists(file_.id(), name.c_str(), H5P_DEFAULT) > 0;
}

bool Reader::has_attribute(const std::string& object, const std::string& name) {
  return status_.has_value() &&
         H5Aexists_by_name(file_.id(), object.c_str(), name.c_str(), H5P_DEFAULT) > 0;
}

bool Reader::is_integer(const std::string& name) {
  return status_ && H5Tget_class(OpenColumn(file_, name).type.id()) == H5T_INTEGER;
}

std::size_t Reader::text_width(const std::string& name) {
  if (!status_) return 0;
  std::array<hsize_t, 2> size{0, 0};
  require(OpenColumn(file_, name).read_size(size) == 2, name,
          "column missing, damaged or not two-dimensional");
  return static_cast<std::size_t>(size[1]);
}

std::uint64_t Reader::rows_of(const std::string& name) {
  std::array<hsize_t, 2> size{0, 0};
  OpenColumn(file_, name).read_size(size);
  return size[0];
}

bool Reader::can_read(const std::string& name, std::uint64_t first, std::uint64_t rows) {
  if (rows == 0) return true;
  const OpenColumn column(file_, name);
  std::array<hsize_t, 2> count{0, 1};
  const int dimensions = column.read_size(count);
  const std::array<hsize_t, 2> start{first, 0};
  count[0] = rows;
  H5Sselect_hyperslab(column.space.id(), H5S_SELECT_SET, start.data(), nullptr, count.data(),
                      nullptr);
  const Handle slice(H5Screate_simple(dimensions, count.data(), nullptr), H5Sclose);
  std::string bytes(rows * count[1] * H5Tget_size(column.type.id()), '\0');
  return H5Dread(column.handle.id(), column.type.id(), slice.id(), column.space.id(), H5P_DEFAULT,
                 bytes.data()) >= 0;
}

}  // namespace weft::daemon::hdf5
