// Recordings of sound and vibration in HDF5. The first byte selects the input, as in hdf5.cc. E:
// edits of a whole file, which test the reader. B: altered bytes of it. Anything else: the file
// itself.

#include "daemon/storage/recordings/recording_set.hpp"
#include "tests/fuzz/hdf5_edit.hpp"
#include "tests/fuzz/target.hpp"

namespace weft::fuzz::recordings_target {
namespace {

void read(std::span<const std::uint8_t> bytes) {
  const MemoryFile file(bytes);
  const bool says_so = daemon::is_recordings_file(file.path());
  const auto set = daemon::read_recordings(file.path());
  if (!set) return demand(!set.error().what.empty(), "an error says what is wrong");
  demand(says_so, "what was read as recordings says that it is");
  demand(daemon::check(*set).has_value(), "recordings that were read keep their promises");
  for (const auto& recording : set->recordings)
    demand(recording.duration_s() > 0, "a recording that was read lasts");
}

}  // namespace

WEFT_FUZZ_TARGET(recordings) {
  const std::span<const std::uint8_t> bytes(data, size);
  if (size > 0 && data[0] == 'E')
    read(edited_file(Sample::recordings, bytes.subspan(1)));
  else if (size > 0 && data[0] == 'B')
    read(patched_file(Sample::recordings, bytes.subspan(1)));
  else
    read(bytes);
  return 0;
}

}  // namespace weft::fuzz::recordings_target
