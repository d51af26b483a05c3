#include "daemon/storage/certificate/hand_over_file.hpp"

#include <nlohmann/json.hpp>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/recorder/campaign_folder.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr const char* evaluation_digest = "evaluation_sha256";
constexpr const char* format_name = "weft-hand-over";
constexpr int hand_over_version = 1;
constexpr std::uintmax_t most_text_bytes = std::uintmax_t{1} << 28;

/// Keys sorted, without white space: what any other program can make as well.
std::string digest_of_evaluation(const json& evaluation) {
  return sha256_hex(evaluation.dump(-1, ' ', false, json::error_handler_t::replace));
}

HandedModel model_from(const json& object) {
  return {object.at("exploration"), object.at("model"),      object.at("sha256"),
          object.at("learner"),     object.at("trained"),    object.at("asked"),
          object.at("accuracy"),    object.at("ci95").at(0), object.at("ci95").at(1)};
}

HandedShare share_from(const json& object) {
  return {object.at("accuracy"), object.at("ci95").at(0), object.at("ci95").at(1)};
}

HandedEvaluation evaluation_from(const json& object) {
  return {object.at("exploration"),
          object.at("page"),
          object.at("learner"),
          object.at("window_s"),
          object.at("recordings"),
          object.at("materials"),
          share_from(object.at("windows")),
          share_from(object.at("slides"))};
}

ordered_json share_json(const HandedShare& share) {
  return {{"accuracy", share.share}, {"ci95", {share.ci95_low, share.ci95_high}}};
}

HandedOver handed_over_from(const json& object) {
  HandedOver out{object.at("bench"), object.at("dataset_sha256"), {}, {}};
  for (const json& model : object.at("models")) out.models.push_back(model_from(model));
  for (const json& one : object.value("evaluations", json::array()))
    out.evaluations.push_back(evaluation_from(one));
  return out;
}

Result<json> read_evaluation(const fs::path& file) {
  const auto text = read_text_file(file, most_list_bytes);
  if (!text) return pass(text.error());
  json object = json::parse(*text, nullptr, false);
  if (!object.is_object() || object.value("format", json()) != format_name ||
      !object.contains(evaluation_digest) || !object[evaluation_digest].is_string())
    return fail(
        {.code = Errc::parse, .where = file.string(), .what = "not the evaluation of a hand-over"});
  if (object.value("version", json()) != hand_over_version)
    return fail({.code = Errc::unsupported,
                 .where = file.string(),
                 .what = "a hand-over of another layout",
                 .expected = std::to_string(hand_over_version),
                 .got = object.value("version", json()).dump()});
  const std::string told = object[evaluation_digest];
  object.erase(evaluation_digest);
  if (const std::string found = digest_of_evaluation(object); found != told)
    return fail({.code = Errc::corrupt,
                 .where = file.string(),
                 .what = "the evaluation was altered: its own digest disagrees",
                 .expected = told,
                 .got = found});
  return object;
}

Status check_file(const fs::path& folder, const json& listed) {
  const std::string name = listed.at("name");
  const auto text = read_text_file(folder / name, most_text_bytes);
  if (!text) return pass(text.error());
  const std::string told = listed.at("sha256"), found = sha256_hex(*text);
  if (told == found) return {};
  return fail({.code = Errc::corrupt,
               .where = name,
               .what = "altered since the hand-over",
               .expected = told,
               .got = found});
}

}  // namespace

ordered_json model_json(const HandedModel& model) {
  return {{"exploration", model.exploration}, {"model", model.file},
          {"sha256", model.sha256},           {"learner", model.learner},
          {"trained", model.trained},         {"asked", model.asked},
          {"accuracy", model.accuracy},       {"ci95", {model.ci95_low, model.ci95_high}}};
}

ordered_json evaluation_line_json(const HandedEvaluation& evaluation) {
  return {{"exploration", evaluation.exploration},
          {"page", evaluation.page},
          {"learner", evaluation.learner},
          {"window_s", evaluation.window_s},
          {"recordings", evaluation.recordings},
          {"materials", evaluation.materials},
          {"windows", share_json(evaluation.windows)},
          {"slides", share_json(evaluation.slides)}};
}

ordered_json handed_over_json(const HandedOver& handed) {
  ordered_json models = ordered_json::array(), evaluations = ordered_json::array();
  for (const HandedModel& model : handed.models) models.push_back(model_json(model));
  for (const HandedEvaluation& one : handed.evaluations)
    evaluations.push_back(evaluation_line_json(one));
  return {{"bench", handed.bench},
          {"dataset_sha256", handed.dataset_sha256},
          {"models", std::move(models)},
          {"evaluations", std::move(evaluations)}};
}

Result<HandedOver> write_hand_over(const fs::path& folder, ordered_json evaluation,
                                   const std::vector<HandOverText>& texts) {
  for (const HandOverText& file : texts)
    if (file.text.size() > most_text_bytes)
      return fail({.code = Errc::range,
                   .where = file.name,
                   .what = "too large to be read again",
                   .expected = "at most " + std::to_string(most_text_bytes) + " bytes",
                   .got = std::to_string(file.text.size()) + " bytes",
                   .hint = "Another learner than trees makes a smaller model"});
  const fs::path target = folder / hand_over_folder_name;
  const fs::path part = folder / (std::string(hand_over_folder_name) + ".partial");
  std::error_code error;
  fs::remove_all(part, error);  // of a process that was killed under it
  if (!error) fs::create_directory(part, error);
  if (error)
    return fail({.code = Errc::io,
                 .where = part.string(),
                 .what = "cannot make the folder",
                 .got = error.message()});
  evaluation["files"] = ordered_json::array();
  for (const HandOverText& file : texts) {
    if (Status ok = write_text_file(part / file.name, file.text); !ok) return pass(ok.error());
    evaluation["files"].push_back(
        {{"name", file.name}, {"bytes", file.text.size()}, {"sha256", sha256_hex(file.text)}});
  }
  ordered_json whole{{"format", format_name}, {"version", hand_over_version}};
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
                   .what = "cannot rename",
                   .got = error.message()});
  }
  if (Status ok = publish_folder(part, target); !ok) return pass(ok.error());
  return handed_over_from(json::parse(plain));
}

Result<std::vector<HandOverFile>> listed_hand_over_files(const fs::path& folder) {
  const fs::path file = folder / hand_over_folder_name / evaluation_file_name;
  std::error_code unseen;
  if (!fs::exists(file, unseen)) return std::vector<HandOverFile>{};
  const auto evaluation = read_evaluation(file);
  if (!evaluation) return pass(evaluation.error());
  std::vector<HandOverFile> out;
  try {
    for (const json& listed : evaluation->at("files"))
      out.push_back({listed.at("name"), listed.at("bytes"), listed.at("sha256")});
  } catch (const json::exception& e) {
    return fail({.code = Errc::parse,
                 .where = file.string(),
                 .what = "not the evaluation of a hand-over",
                 .got = e.what()});
  }
  return out;
}

Result<std::optional<HandedOver>> read_hand_over(const fs::path& folder) {
  const fs::path place = folder / hand_over_folder_name;
  std::error_code unseen;
  if (!fs::exists(place, unseen)) return std::optional<HandedOver>{};
  const auto evaluation = read_evaluation(place / evaluation_file_name);
  if (!evaluation) return pass(evaluation.error());
  try {
    for (const json& listed : evaluation->at("files"))
      if (Status ok = check_file(place, listed); !ok) return pass(ok.error());
    return std::optional(handed_over_from(*evaluation));
  } catch (const json::exception& e) {
    return fail({.code = Errc::parse,
                 .where = place.string(),
                 .what = "not the evaluation of a hand-over",
                 .got = e.what()});
  }
}

void check_hand_over(const fs::path& folder, const std::string& dataset_sha256,
                     VerifyReport& report) {
  const auto found = read_hand_over(folder);
  if (!found) return report.findings.push_back({hand_over_folder_name, to_string(found.error())});
  if (!*found || dataset_sha256.empty() || (*found)->dataset_sha256 == dataset_sha256) return;
  report.findings.push_back({hand_over_folder_name, "trained on another data set (expected " +
                                                        dataset_sha256 + ", got " +
                                                        (*found)->dataset_sha256 + ")"});
}

}  // namespace weft::daemon
