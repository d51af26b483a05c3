#pragma once
// Readers for imprints written by other programs: CSV, PGM, NumPy.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "classifier/imprint/image.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Larger files are refused before they are read.
inline constexpr std::uintmax_t most_image_bytes = std::uintmax_t{256} << 20;

/// A matrix of numbers without a header, one row per line, separated by commas, tabs or blanks.
/// Blank lines and lines that start with # are skipped. Errors: parse with name:line; range for too
/// many taxels.
Result<classifier::imprint::Image> parse_image_csv(const std::string& name, std::string_view text);

/// Netpbm's grey map, plain (P2) or binary (P5), one image, up to 16 bits. Values are not scaled.
Result<classifier::imprint::Image> parse_image_pgm(const std::string& name, std::string_view text);

/// NumPy's .npy, versions 1 to 3: two dimensions in either memory order; b1, u1, i1, and u2, i2,
/// f2, u4, i4, f4, u8, i8, f8 in either byte order. Errors: parse; range for whole numbers beyond
/// 2^53.
Result<classifier::imprint::Image> parse_image_npy(const std::string& name, std::string_view text);

/// Selects the reader by the extension: .csv, .txt, .pgm or .npy. The image is checked: finite
/// values, a usable size.
Result<classifier::imprint::Image> read_image(const std::filesystem::path& path);

}  // namespace weft::daemon
