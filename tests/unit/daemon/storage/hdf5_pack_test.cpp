// Chunks packed on all cores have the place and the bytes that HDF5 and its own filters would give
// them.

#include <hdf5.h>

#include <catch2/catch.hpp>

#include "daemon/storage/dataset/hdf5_columns.hpp"
#include "tests/unit/temporary_folder.hpp"

namespace hdf5_pack_test {

using namespace weft::daemon;
using hdf5::Handle;
using weft::daemon::test::TemporaryFolder;

namespace {

struct StoredChunk {
  haddr_t address = 0;
  unsigned left_out = 0;  ///< filters
  std::string bytes;
  bool operator==(const StoredChunk&) const = default;
};

Handle opened(const std::filesystem::path& path) {
  return {H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose};
}

std::vector<StoredChunk> stored_chunks(const std::filesystem::path& path) {
  std::vector<StoredChunk> out;
  const std::string whole = test::read_file(path);
  const Handle file = opened(path);
  const Handle column(H5Dopen2(file.id(), "/column", H5P_DEFAULT), H5Dclose);
  const Handle space(H5Dget_space(column.id()), H5Sclose);
  hsize_t count = 0;
  REQUIRE(H5Dget_num_chunks(column.id(), space.id(), &count) >= 0);
  for (hsize_t i = 0; i < count; ++i) {
    StoredChunk chunk;
    hsize_t bytes = 0;
    std::array<hsize_t, 2> at{};
    REQUIRE(H5Dget_chunk_info(column.id(), space.id(), i, at.data(), &chunk.left_out,
                              &chunk.address, &bytes) >= 0);
    chunk.bytes = whole.substr(chunk.address, bytes);
    out.push_back(std::move(chunk));
  }
  return out;
}

/// The same column written by the library, with the properties of the file at `like`.
template <class Number>
void write_by_library(const std::filesystem::path& path, const std::filesystem::path& like,
                      const std::vector<Number>& values) {
  const Handle model_file = opened(like);
  const Handle model(H5Dopen2(model_file.id(), "/column", H5P_DEFAULT), H5Dclose);
  const Handle space(H5Dget_space(model.id()), H5Sclose);
  const Handle properties(H5Dget_create_plist(model.id()), H5Pclose);
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_libver_bounds(access.id(), H5F_LIBVER_V110, H5F_LIBVER_V110);
  const Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.id()), H5Fclose);
  const hid_t type = hdf5::native_type<Number>();
  const Handle column(
      H5Dcreate2(file.id(), "/column", type, space.id(), H5P_DEFAULT, properties.id(), H5P_DEFAULT),
      H5Dclose);
  REQUIRE(H5Dwrite(column.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0);
}

template <class Number>
void check_like_library(std::size_t rows, std::size_t width) {
  INFO(rows << " rows of " << width << " numbers of " << sizeof(Number) << " bytes");
  const TemporaryFolder folder;
  std::vector<Number> values(rows * std::max<std::size_t>(width, 1));
  std::uint32_t state = 7;
  for (std::size_t i = 0; i < values.size(); ++i) {
    state = state * 1664525U + 1013904223U;
    values[i] = static_cast<Number>(i / 3 + (state >> 29));  // neither constant nor pure noise
  }
  const hdf5::QuietErrors quiet;
  auto out = hdf5::Writer::create(folder / "packed.h5");
  out.column("/column", values, width);
  REQUIRE(out.close());
  write_by_library(folder / "library.h5", folder / "packed.h5", values);
  const auto packed = stored_chunks(folder / "packed.h5");
  CHECK(packed.size() >= values.size() * sizeof(Number) / (std::size_t{256} << 10));
  CHECK((packed == stored_chunks(folder / "library.h5")));
  CHECK(std::filesystem::file_size(folder / "packed.h5") ==
        std::filesystem::file_size(folder / "library.h5"));
  auto in = hdf5::Reader::open(folder / "packed.h5");
  REQUIRE(in);
  CHECK((in->template column<Number>("/column", width) == values));
}

}  // namespace

TEST_CASE("packed chunks are those of HDF5's own filters, and lie where it puts them") {
  constexpr std::size_t chunk_bytes = std::size_t{256} << 10;
  for (const std::size_t rows : {std::size_t{1}, std::size_t{1000}, chunk_bytes / 8,
                                 chunk_bytes / 8 + 1, 70 * chunk_bytes / 8 - 3})
    check_like_library<std::int64_t>(rows, 0);
  check_like_library<std::uint8_t>(2 * chunk_bytes + 5, 0);
  check_like_library<std::uint16_t>(50000, 16);
  check_like_library<std::int32_t>(40000, 6);
  check_like_library<double>(1, 3);
}

TEST_CASE("text columns are packed in the same way") {
  const TemporaryFolder folder;
  const hdf5::QuietErrors quiet;
  std::vector<std::string> texts;
  for (int i = 0; i < 30000; ++i) texts.push_back("trial " + std::to_string(i * i));
  auto out = hdf5::Writer::create(folder / "t.h5");
  out.column("/column", texts);
  REQUIRE(out.close());
  auto in = hdf5::Reader::open(folder / "t.h5");
  REQUIRE(in);
  CHECK((in->texts("/column") == texts));
  CHECK(stored_chunks(folder / "t.h5").size() > 1);
}

}  // namespace hdf5_pack_test
