#include "daemon/storage/dataset/hdf5_writer.hpp"

#include <algorithm>
#include <array>

namespace weft::daemon::hdf5 {
namespace {

/// Large enough for deflate to find repetitions, small enough for partial reads.
constexpr std::size_t chunk_bytes = std::size_t{256} << 10;

Handle text_type(std::size_t bytes) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), std::max<std::size_t>(bytes, 1));  // HDF5 has no string of size 0
  H5Tset_strpad(type.id(), H5T_STR_NULLPAD);
  H5Tset_cset(type.id(), H5T_CSET_UTF8);
  return type;
}

/// Creation properties: no time stamps, so that equal content makes equal bytes.
Handle column_properties(hsize_t rows, hsize_t width, std::size_t item_bytes, int deflate_level) {
  Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(properties.id(), 0);
  if (rows == 0) return properties;
  const hsize_t columns = std::max<hsize_t>(width, 1);
  const hsize_t fitting = std::max<hsize_t>(1, chunk_bytes / (columns * item_bytes));
  const std::array<hsize_t, 2> chunk{std::min(rows, fitting), columns};
  H5Pset_chunk(properties.id(), width == 0 ? 1 : 2, chunk.data());
  if (deflate_level > 0) {
    H5Pset_shuffle(properties.id());
    H5Pset_deflate(properties.id(), static_cast<unsigned>(deflate_level));
  }
  return properties;
}

}  // namespace

Writer Writer::create(const std::filesystem::path& path, int deflate_level) {
  Writer writer(std::clamp(deflate_level, 0, 9));
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  // The 1.10 layout carries checksums on its own structures; h5py 2.7 of 2017 and later read it.
  H5Pset_libver_bounds(access.id(), H5F_LIBVER_V110, H5F_LIBVER_V110);
  writer.file_ = Handle(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.id()), H5Fclose);
  writer.require(writer.file_.ok(), "cannot create the file");
  return writer;
}

bool Writer::require(bool fine, const char* what) {
  if (!fine && !failed()) status_ = fail({.code = Errc::io, .what = what, .got = last_error()});
  return fine;
}

void Writer::group(const char* name) {
  if (failed()) return;
  const Handle group(H5Gcreate2(file_.id(), name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
  require(group.ok(), "cannot create a group");
}

void Writer::write_attribute(const char* object, const char* name, hid_t type, const void* value) {
  if (failed()) return;
  const Handle owner(H5Oopen(file_.id(), object, H5P_DEFAULT), H5Oclose);
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(owner.id(), name, type, space.id(), H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  require(attribute.ok() && H5Awrite(attribute.id(), type, value) >= 0,
          "cannot write an attribute");
}

void Writer::attribute(const char* object, const char* name, std::string_view text) {
  const std::string padded(text.empty() ? std::string_view("\0", 1) : text);
  write_attribute(object, name, text_type(padded.size()).id(), padded.data());
}

void Writer::attribute(const char* object, const char* name, double value) {
  write_attribute(object, name, H5T_NATIVE_DOUBLE, &value);
}

void Writer::attribute(const char* object, const char* name, std::uint64_t value) {
  write_attribute(object, name, H5T_NATIVE_UINT64, &value);
}

void Writer::attribute(const char* object, const char* name, std::uint32_t value) {
  write_attribute(object, name, H5T_NATIVE_UINT32, &value);
}

void Writer::write_column(const char* name, hid_t type, const void* values, std::size_t count,
                          std::size_t width, std::size_t item_bytes) {
  if (failed()) return;
  const std::array<hsize_t, 2> size{count / std::max<std::size_t>(width, 1), width};
  const Handle space(H5Screate_simple(width == 0 ? 1 : 2, size.data(), nullptr), H5Sclose);
  const Handle properties = column_properties(size[0], width, item_bytes, deflate_level_);
  const Handle column(
      H5Dcreate2(file_.id(), name, type, space.id(), H5P_DEFAULT, properties.id(), H5P_DEFAULT),
      H5Dclose);
  if (!require(column.ok(), "cannot create a column") || count == 0) return;
  require(H5Dwrite(column.id(), type, whole_column, whole_column, H5P_DEFAULT, values) >= 0,
          "cannot write a column");
}

void Writer::column(const char* name, const std::vector<std::string>& texts) {
  std::size_t width = 1;
  for (const std::string& text : texts) width = std::max(width, text.size());
  std::string padded;
  for (const std::string& text : texts) padded += text + std::string(width - text.size(), '\0');
  write_column(name, text_type(width).id(), padded.data(), texts.size(), 0, width);
}

void Writer::document(const char* name, std::string_view text) {
  if (failed()) return;
  const std::string padded(text.empty() ? std::string_view("\0", 1) : text);
  const Handle type = text_type(padded.size());
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle properties = column_properties(0, 0, 1, 0);
  const Handle document(H5Dcreate2(file_.id(), name, type.id(), space.id(), H5P_DEFAULT,
                                   properties.id(), H5P_DEFAULT),
                        H5Dclose);
  require(document.ok() && H5Dwrite(document.id(), type.id(), whole_column, whole_column,
                                    H5P_DEFAULT, padded.data()) >= 0,
          "cannot write a document");
}

Status Writer::close() {
  require(file_.close(), "cannot bring the whole file to the disk");
  return status_;
}

}  // namespace weft::daemon::hdf5
