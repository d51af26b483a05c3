// HDF5 data sets. The first byte selects the input. E: edits of a whole data set (hdf5_edit.hpp),
// which test the reader. B: altered bytes of it. Anything else: the file itself. The last two
// mostly test the HDF5 library.

#include "daemon/storage/dataset/hdf5_file.hpp"
#include "tests/fuzz/hdf5_edit.hpp"
#include "tests/fuzz/target.hpp"

namespace weft::fuzz::hdf5_target {
namespace {

using namespace weft::daemon;

void read(std::span<const std::uint8_t> bytes, bool verify_digest) {
  const MemoryFile file(bytes);
  const auto dataset = read_hdf5(file.path(), verify_digest);
  if (!dataset) return demand(!dataset.error().what.empty(), "an error says what is wrong");
  demand(check(*dataset).has_value(), "a data set that was read keeps its promises");
  demand(dataset_sha256(*dataset).size() == 64, "a data set that was read has a digest");
}

void read_every_way(std::span<const std::uint8_t> bytes) {
  read(bytes, false);
  read(bytes, true);
}

}  // namespace

WEFT_FUZZ_TARGET(hdf5) {
  const std::span<const std::uint8_t> bytes(data, size);
  if (size > 0 && data[0] == 'E')
    read_every_way(edited_file(Sample::dataset, bytes.subspan(1)));
  else if (size > 0 && data[0] == 'B')
    read_every_way(patched_file(Sample::dataset, bytes.subspan(1)));
  else
    read_every_way(bytes);
  return 0;
}

}  // namespace weft::fuzz::hdf5_target
