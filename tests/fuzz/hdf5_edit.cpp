#include "tests/fuzz/hdf5_edit.hpp"

#include <hdf5.h>

#include <array>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include "daemon/storage/dataset/hdf5_columns.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/recordings/recording_set.hpp"
#include "tests/fuzz/samples.hpp"
#include "tests/fuzz/target.hpp"

namespace weft::fuzz {
namespace {

using daemon::hdf5::Handle;
using daemon::hdf5::whole_column;

constexpr std::size_t edit_bytes = 5;
constexpr std::size_t patch_bytes = 4;

struct Edit {
  std::uint8_t operation, object, a, b, c;
};

std::vector<std::uint8_t> make_sample(Sample of) {
  const auto path =
      std::filesystem::temp_directory_path() / ("weft-fuzz-" + std::to_string(::getpid()) + ".h5");
  const bool written = of == Sample::dataset
                           ? daemon::write_hdf5(sample_dataset(), path).has_value()
                           : daemon::write_recordings(sample_recordings(), path).has_value();
  demand(written, "the sample can be written");
  std::ifstream in(path, std::ios::binary);
  std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in), {}};
  std::filesystem::remove(path);
  return bytes;
}

const std::vector<std::uint8_t>& sample(Sample of) {
  static std::array<std::vector<std::uint8_t>, 2> images;
  std::vector<std::uint8_t>& image = images.at(static_cast<std::size_t>(of));
  if (image.empty()) image = make_sample(of);
  return image;
}

/// Groups and columns of the sample. Listed once: HDF5 1.10 may crash when it walks through an
/// edited file, which the reader never does.
std::vector<std::string> list_objects(hid_t file) {
  std::vector<std::string> names;
  const auto visit = [](hid_t, const char* name, const H5O_info_t*, void* out) -> herr_t {
    if (name != std::string_view(".")) static_cast<std::vector<std::string>*>(out)->push_back(name);
    return 0;
  };
  H5Ovisit(file, H5_INDEX_NAME, H5_ITER_INC, visit, &names);
  names.emplace_back("/");
  return names;
}

/// A fixed text or one of the number types; for 7 a text of variable length.
Handle type_of(std::uint8_t choice) {
  const std::array numbers{H5T_NATIVE_UINT8, H5T_NATIVE_UINT16, H5T_NATIVE_INT32,
                           H5T_NATIVE_INT64, H5T_NATIVE_DOUBLE, H5T_NATIVE_FLOAT};
  if (choice % 8 < 6) return {H5Tcopy(numbers[choice % 8]), H5Tclose};
  Handle text(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(text.id(), choice % 8 == 6 ? std::size_t{choice} + 1 : H5T_VARIABLE);
  return text;
}

/// Up to three extents: small, or extremely large in chunks that are never written.
Handle space_of(std::uint8_t shape, std::uint8_t extent) {
  const int rank = shape % 4;
  if (rank == 0) return {H5Screate(extent % 2 == 0 ? H5S_SCALAR : H5S_NULL), H5Sclose};
  const hsize_t size = extent < 200 ? extent % 9 : hsize_t{1} << (extent - 200);
  const std::array<hsize_t, 3> sizes{size, hsize_t{2} + (shape >> 4), 1};
  return {H5Screate_simple(rank, sizes.data(), nullptr), H5Sclose};
}

void replace_column(hid_t file, const std::string& name, const Edit& edit) {
  H5Ldelete(file, name.c_str(), H5P_DEFAULT);
  const Handle type = type_of(edit.a);
  const Handle space = space_of(edit.b, edit.c);
  const Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  const std::array<hsize_t, 3> chunk{1, 1, 1};
  if (edit.b % 4 > 0) H5Pset_chunk(layout.id(), edit.b % 4, chunk.data());
  const Handle made(
      H5Dcreate2(file, name.c_str(), type.id(), space.id(), H5P_DEFAULT, layout.id(), H5P_DEFAULT),
      H5Dclose);
}

void replace_attribute(hid_t file, const std::string& name, const Edit& edit) {
  const Handle object(H5Oopen(file, name.c_str(), H5P_DEFAULT), H5Oclose);
  std::array<char, 64> attribute{};
  if (H5Aget_name_by_idx(object.id(), ".", H5_INDEX_NAME, H5_ITER_INC, edit.c % 16,
                         attribute.data(), attribute.size(), H5P_DEFAULT) < 0)
    return;
  H5Adelete(object.id(), attribute.data());
  const Handle type = type_of(edit.a);
  const Handle space = space_of(edit.b, edit.b);
  if (H5Sget_simple_extent_npoints(space.id()) > 100) return;
  const Handle made(
      H5Acreate2(object.id(), attribute.data(), type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  const std::vector<std::uint8_t> value(std::size_t{100} * 300, edit.c);
  if (edit.a % 8 != 7) H5Awrite(made.id(), type.id(), value.data());
}

/// Changes one byte of a column's values.
void alter_value(hid_t file, const std::string& name, const Edit& edit) {
  const Handle column(H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose);
  const Handle type(H5Dget_type(column.id()), H5Tclose);
  const Handle space(H5Dget_space(column.id()), H5Sclose);
  const hssize_t items = H5Sget_simple_extent_npoints(space.id());
  if (items <= 0 || items > 10'000 || H5Tis_variable_str(type.id()) > 0) return;
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(items) * H5Tget_size(type.id()));
  if (H5Dread(column.id(), type.id(), whole_column, whole_column, H5P_DEFAULT, bytes.data()) < 0)
    return;
  bytes[(std::size_t{edit.a} * 256 + edit.b) % bytes.size()] = edit.c;
  H5Dwrite(column.id(), type.id(), whole_column, whole_column, H5P_DEFAULT, bytes.data());
}

/// Replaces an object by another column, a group, or a link to itself.
void replace_by_link(hid_t file, const std::string& name, const std::string& other,
                     const Edit& edit) {
  H5Ldelete(file, name.c_str(), H5P_DEFAULT);
  if (edit.b % 3 == 0)
    H5Lcreate_hard(file, other.c_str(), file, name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
  if (edit.b % 3 == 1)
    const Handle group(H5Gcreate2(file, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                       H5Gclose);
  if (edit.b % 3 == 2)
    H5Lcreate_soft(("/" + name).c_str(), file, name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
}

/// `names`: objects of the unedited sample.
void apply(hid_t file, const std::vector<std::string>& names, const Edit& edit) {
  const std::string& name = names[edit.object % names.size()];
  switch (edit.operation % 5) {
    case 0:
      H5Ldelete(file, name.c_str(), H5P_DEFAULT);
      break;
    case 1:
      replace_column(file, name, edit);
      break;
    case 2:
      replace_attribute(file, name, edit);
      break;
    case 3:
      alter_value(file, name, edit);
      break;
    default:
      replace_by_link(file, name, names[edit.a % names.size()], edit);
  }
}

std::vector<std::uint8_t> make_image(hid_t file) {
  H5Fflush(file, H5F_SCOPE_GLOBAL);
  const ssize_t bytes = H5Fget_file_image(file, nullptr, 0);
  if (bytes <= 0) return {};
  std::vector<std::uint8_t> image(static_cast<std::size_t>(bytes));
  H5Fget_file_image(file, image.data(), image.size());
  return image;
}

}  // namespace

std::vector<std::uint8_t> edited_file(Sample of, std::span<const std::uint8_t> script) {
  const daemon::hdf5::QuietErrors quiet;
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fapl_core(access.id(), std::size_t{1} << 16, false);
  std::vector<std::uint8_t> image = sample(of);  // HDF5 copies it
  H5Pset_file_image(access.id(), image.data(), image.size());
  const Handle file(H5Fopen("sample", H5F_ACC_RDWR, access.id()), H5Fclose);
  demand(file.ok(), "the sample can be opened");
  static std::array<std::vector<std::string>, 2> listed;
  std::vector<std::string>& names = listed.at(static_cast<std::size_t>(of));
  if (names.empty()) names = list_objects(file.id());
  for (; script.size() >= edit_bytes; script = script.subspan(edit_bytes))
    apply(file.id(), names, {script[0], script[1], script[2], script[3], script[4]});
  return make_image(file.id());
}

std::vector<std::uint8_t> patched_file(Sample of, std::span<const std::uint8_t> script) {
  std::vector<std::uint8_t> image = sample(of);
  for (; script.size() >= patch_bytes; script = script.subspan(patch_bytes)) {
    const std::size_t at = std::size_t{script[0]} << 16 | std::size_t{script[1]} << 8 | script[2];
    image[at % image.size()] = script[3];
  }
  return image;
}

}  // namespace weft::fuzz
