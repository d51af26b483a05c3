#pragma once
// Well-formed HDF5 files that are not valid data sets: HDF5 accepts them, so the reader must check
// them.

#include <cstdint>
#include <span>
#include <vector>

namespace weft::fuzz {

/// One of the program's own files: sample_dataset() or sample_recordings().
enum class Sample : std::uint8_t { dataset, recordings };

/// A sample as a file image, edited by `script`: five bytes an edit (operation, object, and three
/// that the operation reads). Any script is valid; edits that HDF5 refuses are skipped.
std::vector<std::uint8_t> edited_file(Sample of, std::span<const std::uint8_t> script);

/// A sample with altered bytes: four bytes of `script` for each, three of them its offset.
std::vector<std::uint8_t> patched_file(Sample of, std::span<const std::uint8_t> script);

}  // namespace weft::fuzz
