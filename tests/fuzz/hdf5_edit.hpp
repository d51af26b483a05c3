#pragma once
// Well-formed HDF5 files that are not the data sets they claim to be: what HDF5 itself accepts, the
// reader has to judge.

#include <cstdint>
#include <span>
#include <vector>

namespace weft::fuzz {

/// Which of the program's own files: sample_dataset() or sample_recordings().
enum class Sample : std::uint8_t { dataset, recordings };

/// A sample as a file image, changed as `script` says: five bytes an edit (operation,
/// object, and three that the operation reads). Any script is an input; edits that HDF5 refuses are
/// left out.
std::vector<std::uint8_t> edited_file(Sample of, std::span<const std::uint8_t> script);

/// A sample with bytes altered: four bytes a place, three of them its offset.
std::vector<std::uint8_t> patched_file(Sample of, std::span<const std::uint8_t> script);

}  // namespace weft::fuzz
