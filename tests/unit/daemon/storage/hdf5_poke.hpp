#pragma once
// Changes of an HDF5 file that bypass the format.

#include <hdf5.h>

#include <array>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "daemon/storage/dataset/hdf5_columns.hpp"

namespace weft::daemon::test {

/// Changes one number of one column.
template <class Number>
void poke(const std::filesystem::path& path, const char* column_name, hsize_t row, Number value) {
  using hdf5::Handle;
  const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose);
  const Handle column(H5Dopen2(file.id(), column_name, H5P_DEFAULT), H5Dclose);
  const Handle space(H5Dget_space(column.id()), H5Sclose);
  const std::array<hsize_t, 2> start{row, 0};
  const std::array<hsize_t, 2> count{1, 1};
  REQUIRE(H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, start.data(), nullptr, count.data(),
                              nullptr) >= 0);
  const Handle one(H5Screate_simple(H5Sget_simple_extent_ndims(space.id()), count.data(), nullptr),
                   H5Sclose);
  REQUIRE(H5Dwrite(column.id(), hdf5::native_type<Number>(), one.id(), space.id(), H5P_DEFAULT,
                   &value) >= 0);
}

/// Flips a bit in the middle of the stored chunk with this row of a column.
inline void flip_stored_bit(const std::filesystem::path& path, const char* column_name,
                            hsize_t row) {
  using hdf5::Handle;
  haddr_t address = 0;
  hsize_t bytes = 0;
  {
    const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    const Handle column(H5Dopen2(file.id(), column_name, H5P_DEFAULT), H5Dclose);
    const Handle properties(H5Dget_create_plist(column.id()), H5Pclose);
    std::array<hsize_t, 2> chunk{1, 1}, at{0, 0};
    REQUIRE(H5Pget_chunk(properties.id(), 2, chunk.data()) > 0);
    at[0] = row / chunk[0] * chunk[0];
    unsigned filters = 0;
    REQUIRE(H5Dget_chunk_info_by_coord(column.id(), at.data(), &filters, &address, &bytes) >= 0);
  }
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  const auto place = static_cast<std::streamoff>(address + bytes / 2);
  file.seekg(place);
  const int byte = file.get();
  file.seekp(place);
  file.put(static_cast<char>(byte ^ 0x10));
  REQUIRE(file.good());
}

/// Changes a number in an attribute of a group or column.
inline void poke_attribute(const std::filesystem::path& path, const char* object, const char* name,
                           double value) {
  using hdf5::Handle;
  const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose);
  REQUIRE(H5Adelete_by_name(file.id(), object, name, H5P_DEFAULT) >= 0);
  const Handle one(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate_by_name(file.id(), object, name, H5T_NATIVE_DOUBLE, one.id(),
                                           H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  REQUIRE(H5Awrite(attribute.id(), H5T_NATIVE_DOUBLE, &value) >= 0);
}

/// Removes a group, a column, or (`attribute` not null) an attribute of it from the file.
inline void take_out(const std::filesystem::path& path, const char* object,
                     const char* attribute = nullptr) {
  const hdf5::Handle file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose);
  REQUIRE((attribute == nullptr
               ? H5Ldelete(file.id(), object, H5P_DEFAULT)
               : H5Adelete_by_name(file.id(), object, attribute, H5P_DEFAULT)) >= 0);
}

}  // namespace weft::daemon::test
