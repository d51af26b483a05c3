#include <nlohmann/json.hpp>

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/certificate/certificate.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;

constexpr const char* own_digest = "certificate_sha256";
constexpr int certificate_version = 2;
constexpr int oldest_version = 1;  ///< with checksums of blocks, which are passed over

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
  for (const FileChecksums& file : c.files)
    out["files"].push_back({{"name", file.name}, {"bytes", file.bytes}, {"sha256", file.sha256}});
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
  for (const json& file : object.at("files"))
    c.files.push_back({file.at("name"), file.at("bytes"), file.at("sha256")});
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
    const json& version = object.at("version");
    if (object.at("format") != "weft-certificate" ||
        (version != certificate_version && version != oldest_version))
      return fail({.code = Errc::unsupported,
                   .what = "a certificate of another layout",
                   .expected = std::to_string(certificate_version)});
    return certificate_from(object);
  } catch (const json::exception& e) {
    return fail({.code = Errc::parse, .what = "not a certificate of Weft", .got = e.what()});
  }
}

}  // namespace weft::daemon
