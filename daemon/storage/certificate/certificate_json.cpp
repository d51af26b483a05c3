#include <charconv>
#include <nlohmann/json.hpp>

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/certificate/certificate.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;

constexpr const char* own_digest = "certificate_sha256";
constexpr int certificate_version = 1;

std::string format_hex(const std::vector<std::uint32_t>& numbers) {
  constexpr char digits[] = "0123456789abcdef";
  std::string text;
  text.reserve(numbers.size() * 8);
  for (const std::uint32_t number : numbers)
    for (int shift = 28; shift >= 0; shift -= 4) text += digits[number >> shift & 0xF];
  return text;
}

std::vector<std::uint32_t> parse_hex_numbers(const std::string& hex) {
  std::vector<std::uint32_t> numbers;
  for (std::size_t i = 0; i + 8 <= hex.size(); i += 8) {
    std::uint32_t number = 0;
    std::from_chars(hex.data() + i, hex.data() + i + 8, number, 16);
    numbers.push_back(number);
  }
  return numbers;
}

json trial_json(const CertifiedTrial& trial) {
  json gaps = json::array();
  for (const CertifiedGap& gap : trial.gaps)
    gaps.push_back(
        {{"stream", gap.stream}, {"before_sequence", gap.before_sequence}, {"lost", gap.lost}});
  return {{"name", trial.name},
          {"outcome", trial.outcome},
          {"sha256", trial.sha256},
          {"catalogue_sha256", trial.catalogue_sha256},
          {"gaps", std::move(gaps)}};
}

json file_json(const FileChecksums& file) {
  json regions = json::array();
  for (const FileRegion& region : file.regions)
    regions.push_back({region.first, region.bytes, region.holds});
  return {{"name", file.name},
          {"bytes", file.bytes},
          {"sha256", file.sha256},
          {"block_bytes", FileChecksums::block_bytes},
          {"block_crc32", format_hex(file.block_crc32)},
          {"regions", std::move(regions)}};
}

CertifiedTrial trial_from(const json& object) {
  CertifiedTrial trial{object.at("name"),
                       object.at("outcome"),
                       object.at("sha256"),
                       object.at("catalogue_sha256"),
                       {}};
  for (const json& gap : object.at("gaps"))
    trial.gaps.push_back({gap.at("stream"), gap.at("before_sequence"), gap.at("lost")});
  return trial;
}

FileChecksums file_from(const json& object) {
  FileChecksums file;
  file.name = object.at("name");
  file.bytes = object.at("bytes");
  file.sha256 = object.at("sha256");
  file.block_crc32 = parse_hex_numbers(object.at("block_crc32").get_ref<const std::string&>());
  for (const json& region : object.at("regions"))
    file.regions.push_back({region.at(0), region.at(1), region.at(2)});
  return file;
}

json all_of(const Certificate& c) {
  json out{{"format", "weft-certificate"},
           {"version", certificate_version},
           {"bench_kind", c.bench_kind},
           {"name", c.name},
           {"seed", c.seed},
           {"software_version", c.software_version},
           {"recipe_sha256", c.recipe_sha256},
           {"rig_sha256", c.rig_sha256},
           {"trials_planned", c.trials_planned},
           {"dataset_sha256", c.dataset_sha256}};
  for (const char* list : {"devices", "trials", "tables", "files"}) out[list] = json::array();
  for (const DeviceInfo& device : c.devices)
    out["devices"].push_back({{"name", device.name},
                              {"driver", device.driver},
                              {"identity_json", device.identity_json}});
  for (const EndedEarly& some : c.ended_early)
    out["ended_early"].push_back(
        {{"label", some.label}, {"exploration", some.exploration}, {"trials", some.trials}});
  for (const CertifiedTrial& trial : c.trials) out["trials"].push_back(trial_json(trial));
  for (const CertifiedTable& table : c.tables)
    out["tables"].push_back({{"name", table.name}, {"sha256", table.sha256}});
  for (const FileChecksums& file : c.files) out["files"].push_back(file_json(file));
  return out;
}

Certificate certificate_from(const json& object) {
  Certificate c;
  c.bench_kind = object.at("bench_kind");
  c.name = object.at("name");
  c.seed = object.at("seed");
  c.software_version = object.at("software_version");
  c.recipe_sha256 = object.at("recipe_sha256");
  c.rig_sha256 = object.at("rig_sha256");
  c.trials_planned = object.at("trials_planned");
  c.dataset_sha256 = object.at("dataset_sha256");
  for (const json& d : object.at("devices"))
    c.devices.push_back({d.at("name"), d.at("driver"), d.at("identity_json")});
  for (const json& some : object.value("ended_early", json::array()))  // as a rule there are none
    c.ended_early.push_back({some.at("label"), some.at("exploration"), some.at("trials")});
  for (const json& trial : object.at("trials")) c.trials.push_back(trial_from(trial));
  for (const json& table : object.at("tables"))
    c.tables.push_back({table.at("name"), table.at("sha256")});
  for (const json& file : object.at("files")) c.files.push_back(file_from(file));
  return c;
}

}  // namespace

std::string to_json(const Certificate& certificate) {
  json out = all_of(certificate);
  out[own_digest] = sha256_hex(out.dump());
  return out.dump(1) + "\n";
}

Result<Certificate> certificate_from_json(const std::string& text) {
  json object = json::parse(text, nullptr, false);
  if (!object.is_object() || !object.contains(own_digest) || !object[own_digest].is_string())
    return fail({.code = Errc::parse, .what = "not a certificate of Weft"});
  const std::string recorded = object[own_digest];
  object.erase(own_digest);
  // Text that is no UTF-8 cannot be dumped, nor does it parse.
  if (const std::string found = sha256_hex(object.dump()); found != recorded)
    return fail({.code = Errc::corrupt,
                 .what = "the certificate itself was altered: its digest disagrees",
                 .expected = recorded,
                 .got = found});
  try {
    if (object.at("format") != "weft-certificate" || object.at("version") != certificate_version)
      return fail({.code = Errc::unsupported,
                   .what = "a certificate of another layout",
                   .expected = std::to_string(certificate_version)});
    return certificate_from(object);
  } catch (const json::exception& e) {
    return fail({.code = Errc::parse, .what = "not a certificate of Weft", .got = e.what()});
  }
}

}  // namespace weft::daemon
