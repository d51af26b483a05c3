#include "daemon/base/file/file_kind.hpp"

#include <algorithm>
#include <array>
#include <fstream>

namespace weft::daemon {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view sound_advice =
    "List sound files in a manifest (file,label) for `weft dataset import --format recordings`";
constexpr std::string_view image_advice =
    "List imprints in a manifest (file,label) for `weft dataset import --format imprints`";
constexpr std::string_view table_advice = "Export the table as CSV text, separated by commas";

struct Signature {
  std::string_view bytes;
  FileKind kind;
  bool letters = false;  // text may start like this too, so the file must also have zero bytes
};
constexpr std::array<Signature, 35> signatures{{
    {"\x89HDF\r\n\x1a\n"sv,
     {"an HDF5 file", "Use it with `weft dataset info`, `train`, `evaluate` or `classify`"}},
    {"RIFF"sv, {"a sound file (WAV)", sound_advice}, true},
    {"RF64"sv, {"a sound file (WAV)", sound_advice}, true},
    {"fLaC"sv, {"a sound file (FLAC)", sound_advice}, true},
    {"OggS"sv, {"a sound file (Ogg)", sound_advice}, true},
    {"FORM"sv, {"a sound file (AIFF)", sound_advice}, true},
    {"ID3"sv, {"a sound file (MP3)", sound_advice}, true},
    {"SQLite format 3\0"sv,
     {"an SQLite file", "Export a campaign as a data set with `weft dataset export`"}},
    {"\x93NUMPY"sv, {"a NumPy array", image_advice}},
    {"P2\n"sv, {"a grey map (PGM)", image_advice}},
    {"P5\n"sv, {"a grey map (PGM)", image_advice}},
    {"\x89PNG"sv, {"a picture (PNG)", "Convert imprints to .csv, .txt, .pgm or .npy"}},
    {"PK\x03\x04"sv, {"a spreadsheet (.xlsx), .npz or another ZIP archive", table_advice}},
    {"\xD0\xCF\x11\xE0"sv, {"a spreadsheet (.xls)", table_advice}},
    {"MATLAB 5.0"sv, {"a MATLAB file", table_advice}, true},
    {"MATLAB 7.3"sv, {"a MATLAB file", table_advice}, true},
    {"PAR1"sv, {"a Parquet table", table_advice}, true},
    {"ARROW1"sv, {"an Arrow table", table_advice}, true},
    {"TDSm"sv, {"a LabVIEW file (TDMS)", table_advice}, true},
    {"#ROSBAG"sv, {"a ROS bag", table_advice}},
    {"\x80\x04\x95"sv, {"a Python pickle", table_advice}},
    {"{\""sv, {"JSON text", table_advice}},
    {"{\n"sv, {"JSON text", table_advice}},
    {"<!DOCTYPE html"sv, {"a web page", "Download the file itself instead of its web page"}},
    {"<html"sv, {"a web page", "Download the file itself instead of its web page"}},
    {"version https://git-lfs"sv, {"a Git LFS pointer, not the file", "Run `git lfs pull`"}},
    {"%PDF-"sv, {"a PDF document", table_advice}},
    {"\x1f\x8b"sv, {"a gzip archive", "Unpack it with gunzip"}},
    {"BZh"sv, {"a bzip2 archive", "Unpack it with bunzip2"}, true},
    {"\xFD\x37zXZ"sv, {"an XZ archive", "Unpack it with unxz"}},
    {"\x28\xB5\x2F\xFD"sv, {"a Zstandard archive", "Unpack it with unzstd"}},
    {"7z\xBC\xAF\x27\x1C"sv, {"a 7-Zip archive", "Unpack it first"}},
    {"\xFF\xFB"sv, {"a sound file (MP3)", sound_advice}},
    {"\xFF\xFE"sv, {"text in UTF-16", "Save it again as UTF-8"}},
    {"\xFE\xFF"sv, {"text in UTF-16", "Save it again as UTF-8"}},
}};

bool is_text(std::string_view bytes) {
  return !bytes.empty() && bytes.find('\0') == std::string_view::npos;
}

}  // namespace

FileKind file_kind(std::string_view bytes) {
  if (bytes.starts_with("weft-") && bytes.substr(0, bytes.find('\n')).find("-model ") != bytes.npos)
    return {"a Weft model", "Use it as MODEL in `weft ... classify MODEL DATA`"};
  const auto* const found = std::ranges::find_if(signatures, [&](const Signature& one) {
    return bytes.starts_with(one.bytes) && !(one.letters && is_text(bytes));
  });
  return found == signatures.end() ? FileKind{} : found->kind;
}

Error with_file_kind(Error error, const std::filesystem::path& path) {
  std::string bytes(file_kind_bytes, '\0');
  std::ifstream in(path, std::ios::binary);
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  FileKind kind = file_kind(bytes);
  if (kind.name.empty() && is_text(bytes))
    kind = {"text", "Import tables as a data set, see `weft dataset import --help`"};
  if (kind.name.empty()) return error;
  error.got = kind.name;
  error.hint = kind.advice;
  return error;
}

}  // namespace weft::daemon
