#include "daemon/storage/certificate/handover_file.hpp"

#include <array>
#include <nlohmann/json.hpp>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/recorder/campaign_folder.hpp"
#include "protocols/base/json_text.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr const char* evaluation_digest = "evaluation_sha256";
constexpr const char* format_name = "weft-hand-over";
constexpr int handover_version = 1;
constexpr std::uintmax_t most_text_bytes = std::uintmax_t{1} << 28;

/// Keys sorted, without white space, so that other programs can reproduce the digest.
std::string digest_of_evaluation(const json& evaluation) {
  return sha256_hex(evaluation.dump(-1, ' ', false, json::error_handler_t::replace));
}

tl::unexpected<Error> not_evaluation(const fs::path& file, std::string got = {}) {
  return fail({.code = Errc::parse,
               .where = file,
               .what = "not a handover evaluation",
               .got = std::move(got)});
}

tl::unexpected<Error> altered(std::string where, std::string what, std::string recorded,
                              std::string found) {
  return fail({.code = Errc::corrupt,
               .where = std::move(where),
               .what = std::move(what),
               .expected = std::move(recorded),
               .got = std::move(found)});
}

template <class Json>
HandoverModel model_from(const Json& object) {
  return {object.at("exploration"), object.at("model"),      object.at("sha256"),
          object.at("learner"),     object.at("trained"),    object.at("asked"),
          object.at("accuracy"),    object.at("ci95").at(0), object.at("ci95").at(1)};
}

template <class Json>
HandoverShare share_from(const Json& object) {
  return {object.at("accuracy"), object.at("ci95").at(0), object.at("ci95").at(1)};
}

template <class Json>
HandoverEvaluation evaluation_from(const Json& object) {
  return {object.at("exploration"),
          object.at("page"),
          object.at("learner"),
          object.at("window_s"),
          object.at("recordings"),
          object.at("materials"),
          share_from(object.at("windows")),
          share_from(object.at("slides"))};
}

ordered_json share_json(const HandoverShare& share) {
  return {{"accuracy", share.share}, {"ci95", {share.ci95_low, share.ci95_high}}};
}

Result<json> read_evaluation(const fs::path& file) {
  const auto text = read_text_file(file, most_list_bytes);
  if (!text) return pass(text.error());
  auto document = parse_json(*text);
  if (!document) return pass(document.error(), file.string());
  json& object = *document;
  if (!object.is_object() || object.value("format", json()) != format_name ||
      !object.contains(evaluation_digest) || !object[evaluation_digest].is_string())
    return not_evaluation(file);
  if (object.value("version", json()) != handover_version)
    return fail({.code = Errc::unsupported,
                 .where = file.string(),
                 .what = "unsupported handover version",
                 .expected = std::to_string(handover_version),
                 .got = object.value("version", json()).dump()});
  const std::string recorded = object[evaluation_digest];
  object.erase(evaluation_digest);
  if (const std::string found = digest_of_evaluation(object); found != recorded)
    return altered(file, "evaluation altered, wrong digest", recorded, found);
  return object;
}

Status check_file(const fs::path& folder, const json& listed) {
  const std::string name = listed.at("name");
  const auto text = read_text_file(folder / name, most_text_bytes);
  if (!text) return pass(text.error());
  const std::string recorded = listed.at("sha256"), found = sha256_hex(*text);
  if (recorded == found) return {};
  return altered(name, "altered since the handover, wrong digest", recorded, found);
}

constexpr std::array<std::string_view, 6> state_names{"none", "waiting", "running",
                                                      "done", "failed",  "cancelled"};

}  // namespace

HandoverResult handover_result_from(const ordered_json& evaluation) {
  HandoverResult out{evaluation.at("bench"), evaluation.at("dataset_sha256"), {}, {}};
  for (const auto& model : evaluation.at("models")) out.models.push_back(model_from(model));
  for (const auto& one : evaluation.value("evaluations", ordered_json::array()))
    out.evaluations.push_back(evaluation_from(one));
  if (const auto results = evaluation.find("results"); results != evaluation.end())
    out.results_json = json(*results).dump(-1, ' ', false, json::error_handler_t::replace);
  return out;
}

ordered_json model_json(const HandoverModel& model) {
  return {{"exploration", model.exploration}, {"model", model.file},
          {"sha256", model.sha256},           {"learner", model.learner},
          {"trained", model.trained},         {"asked", model.requested},
          {"accuracy", model.accuracy},       {"ci95", {model.ci95_low, model.ci95_high}}};
}

ordered_json evaluation_line_json(const HandoverEvaluation& evaluation) {
  return {{"exploration", evaluation.exploration},
          {"page", evaluation.page},
          {"learner", evaluation.learner},
          {"window_s", evaluation.window_s},
          {"recordings", evaluation.recordings},
          {"materials", evaluation.materials},
          {"windows", share_json(evaluation.windows)},
          {"slides", share_json(evaluation.slides)}};
}

ordered_json handover_result_json(const HandoverResult& result) {
  ordered_json models = ordered_json::array(), evaluations = ordered_json::array();
  for (const HandoverModel& model : result.models) models.push_back(model_json(model));
  for (const HandoverEvaluation& one : result.evaluations)
    evaluations.push_back(evaluation_line_json(one));
  ordered_json out{{"bench", result.bench},
                   {"dataset_sha256", result.dataset_sha256},
                   {"models", std::move(models)},
                   {"evaluations", std::move(evaluations)}};
  if (!result.results_json.empty())
    out["results"] = ordered_json::parse(result.results_json, nullptr, false);
  return out;
}

Result<HandoverResult> write_handover(const fs::path& folder, ordered_json evaluation,
                                      const std::vector<HandoverText>& texts) {
  for (const HandoverText& file : texts)
    if (file.text.size() > most_text_bytes)
      return fail({.code = Errc::range,
                   .where = file.name,
                   .what = "handover file too large",
                   .expected = "at most " + std::to_string(most_text_bytes) + " bytes",
                   .got = std::to_string(file.text.size()) + " bytes",
                   .hint = "Choose a learner with a smaller model than trees"});
  const fs::path target = folder / handover_folder_name;
  const fs::path part = folder / (std::string(handover_folder_name) + ".partial");
  std::error_code error;
  fs::remove_all(part, error);  // left by a process that was killed while writing
  if (!error) fs::create_directory(part, error);
  if (error)
    return fail({.code = Errc::io,
                 .where = part.string(),
                 .what = "folder not created",
                 .got = error.message()});
  evaluation["files"] = ordered_json::array();
  for (const HandoverText& file : texts) {
    if (Status ok = write_text_file(part / file.name, file.text); !ok) return pass(ok.error());
    evaluation["files"].push_back(
        {{"name", file.name}, {"bytes", file.text.size()}, {"sha256", sha256_hex(file.text)}});
  }
  ordered_json whole{{"format", format_name}, {"version", handover_version}};
  whole.update(evaluation);
  const std::string plain = whole.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
  whole[evaluation_digest] = digest_of_evaluation(json::parse(plain));
  const std::string text = whole.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
  if (Status ok = write_text_file(part / evaluation_file_name, text); !ok) return pass(ok.error());
  if (const fs::path aside = name_aside(target); !aside.empty()) {
    fs::rename(target, folder / aside, error);
    if (error)
      return fail({.code = Errc::io,
                   .where = target.string(),
                   .what = "folder not renamed",
                   .got = error.message()});
  }
  if (Status ok = publish_folder(part, target); !ok) return pass(ok.error());
  return handover_result_from(whole);
}

Result<std::vector<FileChecksums>> listed_handover_files(const fs::path& folder) {
  const fs::path file = folder / handover_folder_name / evaluation_file_name;
  std::error_code unseen;
  if (!fs::exists(file, unseen)) return std::vector<FileChecksums>{};
  const auto evaluation = read_evaluation(file);
  if (!evaluation) return pass(evaluation.error());
  std::vector<FileChecksums> out;
  try {
    for (const json& listed : evaluation->at("files"))
      out.push_back({listed.at("name"), listed.at("bytes"), listed.at("sha256")});
  } catch (const json::exception& e) {
    return not_evaluation(file, e.what());
  }
  return out;
}

Result<std::optional<HandoverResult>> read_handover(const fs::path& folder) {
  const fs::path place = folder / handover_folder_name;
  std::error_code unseen;
  if (!fs::exists(place, unseen)) return std::optional<HandoverResult>{};
  const auto evaluation = read_evaluation(place / evaluation_file_name);
  if (!evaluation) return pass(evaluation.error());
  try {
    for (const json& listed : evaluation->at("files"))
      if (Status ok = check_file(place, listed); !ok) return pass(ok.error());
    return std::optional(handover_result_from(ordered_json(*evaluation)));
  } catch (const json::exception& e) {
    return not_evaluation(place, e.what());
  }
}

void check_handover(const fs::path& folder, const std::string& dataset_sha256,
                    VerifyReport& report) {
  const auto found = read_handover(folder);
  if (!found) return report.add(handover_folder_name, to_string(found.error()));
  if (!*found || dataset_sha256.empty() || (*found)->dataset_sha256 == dataset_sha256) return;
  report.add(handover_folder_name, "trained on another data set: " + (*found)->dataset_sha256 +
                                       " (expected " + dataset_sha256 + ")");
}

std::string_view to_string(HandoverState state) {
  return state_names[static_cast<std::size_t>(state)];
}

std::optional<HandoverState> handover_state_from(std::string_view word) {
  return enum_named<HandoverState>(state_names, word);
}

bool is_over(HandoverState state) {
  return state != HandoverState::waiting && state != HandoverState::running;
}

}  // namespace weft::daemon
