#include "daemon/storage/dataset/hdf5_reader.hpp"

#include <array>
#include <string_view>

#include "daemon/storage/dataset/hdf5_handle.hpp"

namespace weft::daemon::hdf5 {
namespace {

/// Deflate cannot shrink more than about 1032 to 1: a column that claims more than that of what is
/// stored would only eat memory.
constexpr std::uint64_t max_inflation = 1100;

/// Without the padding that fixed-length strings carry.
std::string unpadded(std::string_view text) {
  return std::string(text.substr(0, text.find('\0')));
}

Handle open_attribute(const Handle& file, const char* object, const char* name) {
  return {H5Aopen_by_name(file.id(), object, name, H5P_DEFAULT, H5P_DEFAULT), H5Aclose};
}

bool is_scalar(const Handle& attribute) {
  const Handle space(H5Aget_space(attribute.id()), H5Sclose);
  return H5Sget_simple_extent_npoints(space.id()) == 1;
}

}  // namespace

Result<Reader> Reader::open(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    return fail({.code = Errc::not_found,
                 .where = path.string(),
                 .what = "a folder where a data set file is due",
                 .hint = "A campaign's data set is the file dataset.h5 in its folder"});
  if (!std::filesystem::is_regular_file(path, ignored))
    return fail({.code = Errc::not_found, .where = path.string(), .what = "no such data set file"});
  if (H5Fis_hdf5(path.c_str()) <= 0)
    return fail({.code = Errc::parse,
                 .where = path.string(),
                 .what = "not an HDF5 file, or cut short within its first bytes"});
  Reader reader;
  reader.file_ = Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!reader.file_.ok())
    return fail({.code = Errc::corrupt,
                 .where = path.string(),
                 .what = "cannot be opened: cut short or damaged",
                 .got = last_error(),
                 .hint = "Export the data set again"});
  return reader;
}

bool Reader::require(bool fine, const char* where, const char* what) {
  if (!fine && status_)
    status_ = fail({.code = Errc::corrupt, .where = where, .what = what, .got = last_error()});
  return fine;
}

std::string Reader::text_attribute(const char* object, const char* name) {
  if (!status_) return {};
  const Handle attribute = open_attribute(file_, object, name);
  if (!require(attribute.ok(), name, "the attribute is missing or damaged")) return {};
  const Handle type(H5Aget_type(attribute.id()), H5Tclose);
  const std::size_t bytes = H5Tget_size(type.id());
  const bool fixed_text = H5Tget_class(type.id()) == H5T_STRING &&
                          H5Tis_variable_str(type.id()) == 0 && bytes <= max_text_bytes;
  if (!require(fixed_text && is_scalar(attribute), name, "the attribute is not a short text"))
    return {};
  std::string text(bytes, '\0');
  require(H5Aread(attribute.id(), type.id(), text.data()) >= 0, name, "unreadable attribute");
  return unpadded(text);
}

double Reader::real_attribute(const char* object, const char* name) {
  double value = 0;
  if (!status_) return value;
  const Handle attribute = open_attribute(file_, object, name);
  require(attribute.ok() && is_scalar(attribute) &&
              H5Aread(attribute.id(), H5T_NATIVE_DOUBLE, &value) >= 0,
          name, "the attribute is missing, damaged or not a number");
  return value;
}

std::uint64_t Reader::integer_attribute(const char* object, const char* name) {
  std::uint64_t value = 0;
  if (!status_) return value;
  const Handle attribute = open_attribute(file_, object, name);
  require(attribute.ok() && is_scalar(attribute) &&
              H5Aread(attribute.id(), H5T_NATIVE_UINT64, &value) >= 0,
          name, "the attribute is missing, damaged or not a whole number");
  return value;
}

std::optional<Reader::Column> Reader::open_column(const char* name, H5T_class_t type_class,
                                                  std::size_t width) {
  if (!status_) return std::nullopt;
  Column column{Handle(H5Dopen2(file_.id(), name, H5P_DEFAULT), H5Dclose)};
  if (!require(column.handle.ok(), name, "the column is missing or damaged")) return std::nullopt;
  const Handle type(H5Dget_type(column.handle.id()), H5Tclose);
  const Handle space(H5Dget_space(column.handle.id()), H5Sclose);
  std::array<hsize_t, 2> size{0, 0};
  const bool shaped = H5Sget_simple_extent_ndims(space.id()) == (width == 0 ? 1 : 2) &&
                      H5Sget_simple_extent_dims(space.id(), size.data(), nullptr) >= 0 &&
                      size[1] == width;
  if (!require(shaped && H5Tget_class(type.id()) == type_class, name,
               "a column of another shape or type"))
    return std::nullopt;
  column.item_bytes = H5Tget_size(type.id());
  const std::uint64_t row_bytes = column.item_bytes * std::max<std::size_t>(width, 1);
  const std::uint64_t limit = H5Dget_storage_size(column.handle.id()) * max_inflation;
  if (!require(row_bytes > 0 && size[0] <= limit / row_bytes, name,
               "the column claims more than is stored"))
    return std::nullopt;
  column.items = static_cast<std::size_t>(size[0]) * std::max<std::size_t>(width, 1);
  return column;
}

void Reader::read_into(const Column& column, const char* name, hid_t type, void* values) {
  if (column.items == 0) return;
  require(H5Dread(column.handle.id(), type, whole_column, whole_column, H5P_DEFAULT, values) >= 0,
          name, damaged_column);
}

std::vector<std::string> Reader::texts(const char* name) {
  const std::optional<Column> column = open_column(name, H5T_STRING, 0);
  if (!column) return {};
  const Handle type(H5Dget_type(column->handle.id()), H5Tclose);
  if (!require(H5Tis_variable_str(type.id()) == 0, name, "a text column of variable length"))
    return {};
  std::string padded(column->items * column->item_bytes, '\0');
  read_into(*column, name, type.id(), padded.data());
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < column->items; ++i)
    texts.push_back(
        unpadded(std::string_view(padded).substr(i * column->item_bytes, column->item_bytes)));
  return texts;
}

std::string Reader::document(const char* name) {
  if (!status_) return {};
  const Handle document(H5Dopen2(file_.id(), name, H5P_DEFAULT), H5Dclose);
  if (!require(document.ok(), name, "the document is missing or damaged")) return {};
  const Handle type(H5Dget_type(document.id()), H5Tclose);
  const Handle space(H5Dget_space(document.id()), H5Sclose);
  const std::size_t bytes = H5Tget_size(type.id());
  const bool fixed_text = H5Tget_class(type.id()) == H5T_STRING &&
                          H5Tis_variable_str(type.id()) == 0 && bytes <= max_document_bytes;
  if (!require(fixed_text && H5Sget_simple_extent_npoints(space.id()) == 1, name, "not a text"))
    return {};
  std::string text(bytes, '\0');
  require(
      H5Dread(document.id(), type.id(), whole_column, whole_column, H5P_DEFAULT, text.data()) >= 0,
      name, "the document is damaged");
  return unpadded(text);
}

bool Reader::has(const char* name) {
  return status_.has_value() && H5Lexists(file_.id(), name, H5P_DEFAULT) > 0;
}

bool Reader::has_attribute(const char* object, const char* name) {
  return status_.has_value() && H5Aexists_by_name(file_.id(), object, name, H5P_DEFAULT) > 0;
}

bool Reader::is_integer(const char* name) {
  if (!status_) return false;
  const Handle column(H5Dopen2(file_.id(), name, H5P_DEFAULT), H5Dclose);
  const Handle type(H5Dget_type(column.id()), H5Tclose);
  return H5Tget_class(type.id()) == H5T_INTEGER;
}

std::size_t Reader::text_width(const char* name) {
  if (!status_) return 0;
  const Handle column(H5Dopen2(file_.id(), name, H5P_DEFAULT), H5Dclose);
  const Handle space(H5Dget_space(column.id()), H5Sclose);
  std::array<hsize_t, 2> size{0, 0};
  const bool two_dimensional = H5Sget_simple_extent_ndims(space.id()) == 2 &&
                               H5Sget_simple_extent_dims(space.id(), size.data(), nullptr) >= 0;
  require(two_dimensional, name, "the column is missing, damaged or not two-dimensional");
  return static_cast<std::size_t>(size[1]);
}

std::uint64_t Reader::rows_of(const char* name) {
  const Handle column(H5Dopen2(file_.id(), name, H5P_DEFAULT), H5Dclose);
  const Handle space(H5Dget_space(column.id()), H5Sclose);
  std::array<hsize_t, 2> size{0, 0};
  H5Sget_simple_extent_dims(space.id(), size.data(), nullptr);
  return size[0];
}

bool Reader::can_read(const char* name, std::uint64_t first, std::uint64_t rows) {
  if (rows == 0) return true;
  const Handle column(H5Dopen2(file_.id(), name, H5P_DEFAULT), H5Dclose);
  const Handle type(H5Dget_type(column.id()), H5Tclose);
  const Handle space(H5Dget_space(column.id()), H5Sclose);
  std::array<hsize_t, 2> count{0, 1};
  const int dimensions = H5Sget_simple_extent_dims(space.id(), count.data(), nullptr);
  const std::array<hsize_t, 2> start{first, 0};
  count[0] = rows;
  H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
  const Handle slice(H5Screate_simple(dimensions, count.data(), nullptr), H5Sclose);
  std::string bytes(rows * count[1] * H5Tget_size(type.id()), '\0');
  return H5Dread(column.id(), type.id(), slice.id(), space.id(), H5P_DEFAULT, bytes.data()) >= 0;
}

}  // namespace weft::daemon::hdf5
