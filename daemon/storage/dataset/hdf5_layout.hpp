#pragma once
// What the writer and the reader of a data set file agree on (docs/dataset.md, "HDF5 layout").

#include <cstdint>

namespace weft::daemon::hdf5 {

constexpr const char* format_name = "weft-dataset";
constexpr std::uint32_t format_version = 1;

/// Longest text in a table column or attribute: names and labels, not documents.
constexpr std::size_t max_text_bytes = 4096;
/// Documents (recipe, rig, device identities) have a data set each.
constexpr std::size_t max_document_bytes = std::size_t{64} << 20;

}  // namespace weft::daemon::hdf5
