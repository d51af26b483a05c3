// Merges the data sets of parts, see parts.hpp.

#include <algorithm>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <tuple>

#include "daemon/base/file/read_file.hpp"
#include "daemon/campaign/parts.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/dataset/dataset_reader.hpp"
#include "daemon/storage/dataset/dataset_writer.hpp"
#include "protocols/base/json_text.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;

/// A data set to be merged. Its file is closed when others need to be open.
struct Source {
  std::filesystem::path file;
  Dataset listed;  ///< without samples
  std::string sha256;
  std::optional<DatasetReader> reader = {};
  std::uint64_t used = 0;  ///< number of its last use
};

/// All data sets, with only a few of their files open at a time.
class Sources {
 public:
  void add(Source source) {
    all_.push_back(std::move(source));
    close_others();
  }
  [[nodiscard]] const std::vector<Source>& all() const { return all_; }

  /// A trial of a data set. Errors: those of DatasetReader; corrupt if the file has changed.
  Result<TrialData> load(std::size_t source, std::size_t trial) {
    Source& one = all_[source];
    one.used = ++uses_;
    if (!one.reader) {
      auto reader = DatasetReader::open(one.file);
      if (!reader) return pass(reader.error());
      if (reader->digest().dataset_sha256 != one.sha256)
        return fail({.code = Errc::corrupt,
                     .where = one.file.string(),
                     .what = "data set has changed meanwhile",
                     .expected = one.sha256,
                     .got = reader->digest().dataset_sha256});
      one.reader.emplace(std::move(*reader));
      close_others();
    }
    return one.reader->load(trial);
  }

 private:
  static constexpr std::ptrdiff_t most_open = 8;

  /// Closes the file that was not used for the longest time.
  void close_others() {
    const auto is_open = [](const Source& one) { return one.reader.has_value(); };
    while (std::ranges::count_if(all_, is_open) > most_open)
      std::ranges::min_element(all_, {}, [&](const Source& one) {
        return is_open(one) ? one.used : std::numeric_limits<std::uint64_t>::max();
      })->reader.reset();
  }

  std::vector<Source> all_;
  std::uint64_t uses_ = 0;
};

/// Files of the inputs, and the parts among them.
struct Inputs {
  struct File {
    std::filesystem::path path;
    std::string sha256;  ///< as its part states it; empty: not part of one
  };
  std::vector<File> files;
  std::map<std::size_t, std::filesystem::path> parts;  ///< by number
  std::size_t count = 0;                               ///< of parts; 0: no part was given
};

Error given_twice(std::string what, const std::filesystem::path& one,
                  const std::filesystem::path& other) {
  return {.code = Errc::invalid_argument,
          .where = other.string(),
          .what = std::move(what) + " is given twice",
          .got = "also in " + one.string(),
          .hint = "Name each part once"};
}

Error incomplete(const std::filesystem::path& folder, std::string what) {
  return {.code = Errc::not_found,
          .where = folder.string(),
          .what = std::move(what) + " not complete",
          .hint = "Continue it with `weft run --part K/N --resume`"};
}

/// Adds the campaigns of a part's folder. Several rigs number their parts independently.
Status add_part(const std::filesystem::path& folder, MergeRigs rigs, Inputs& out) {
  const std::filesystem::path file = folder / part_file_name;
  const auto text = read_text_file(file, most_list_bytes);
  if (!text) return pass(text.error());
  const auto document = parse_json(*text);
  if (!document) return pass(document.error(), file.string());
  try {
    if (document->at("format") != "weft-part" || document->at("version") != 1)
      return fail(
          {.code = Errc::unsupported,
           .where = file.string(),
           .what = "unsupported list of a part",
           .expected = "weft-part, version 1",
           .got = document->at("format").dump() + ", version " + document->at("version").dump()});
    const std::string number = document->at("part").dump() + "/" + document->at("parts").dump();
    if (!part_number_from(number))
      return fail({.code = Errc::parse,
                   .where = file.string(),
                   .what = "invalid part",
                   .expected = "K/N with K from 1 to N",
                   .got = number});
    const PartNumber part = *part_number_from(number);
    if (!document->at("is_complete").get<bool>())
      return tl::unexpected<Error>(incomplete(folder, "part " + to_string(part)));
    const bool is_numbered = rigs == MergeRigs::one;
    if (is_numbered && out.count != 0 && out.count != part.count)
      return fail({.code = Errc::invalid_argument,
                   .where = folder.string(),
                   .what = "number of parts differs from that of the other parts",
                   .expected = std::to_string(out.count),
                   .got = std::to_string(part.count)});
    if (is_numbered) {
      out.count = part.count;
      if (const auto [other, is_new] = out.parts.emplace(part.number, folder); !is_new)
        return tl::unexpected<Error>(given_twice("part " + to_string(part), other->second, folder));
    }
    for (const json& one : document->at("campaigns").get<std::vector<json>>())
      out.files.push_back({folder / one.at("folder").get<std::string>() / dataset_file_name,
                           one.at("dataset_sha256")});
  } catch (const json::exception& e) {
    return fail({.code = Errc::parse,
                 .where = file.string(),
                 .what = "list of a part not readable",
                 .got = e.what()});
  }
  return {};
}

Status require_all_parts(const Inputs& inputs) {
  std::string missing;
  for (std::size_t k = 1; k <= inputs.count; ++k)
    if (!inputs.parts.contains(k))
      missing += (missing.empty() ? "part " : ", part ") + to_string(PartNumber{k, inputs.count});
  if (missing.empty()) return {};
  return fail({.code = Errc::not_found,
               .where = missing,
               .what = "part missing",
               .expected = std::to_string(inputs.count) + " parts",
               .got = std::to_string(inputs.parts.size()),
               .hint = "Run it with `weft run --part`, then merge again"});
}

Result<Inputs> find_inputs(const std::vector<std::filesystem::path>& paths, MergeRigs rigs) {
  Inputs out;
  std::error_code unseen;
  for (const std::filesystem::path& path : paths) {
    if (std::filesystem::exists(path / part_file_name, unseen)) {
      if (Status ok = add_part(path, rigs, out); !ok) return pass(ok.error());
    } else if (std::filesystem::is_directory(path, unseen) &&
               !std::filesystem::exists(path / dataset_file_name, unseen)) {
      return tl::unexpected<Error>(incomplete(path, "part"));
    } else {
      const bool is_folder = std::filesystem::is_directory(path, unseen);
      out.files.push_back({is_folder ? path / dataset_file_name : path, {}});
    }
  }
  if (Status all = require_all_parts(out); !all) return pass(all.error());
  if (out.files.empty()) return fail({.code = Errc::not_found, .what = "parts without a data set"});
  return out;
}

/// Refuses an output that would replace a file of an input.
Status keep_inputs(const std::vector<std::filesystem::path>& paths, const Inputs& inputs,
                   const std::filesystem::path& out) {
  const auto is_output = [&](const std::filesystem::path& file) {
    std::error_code unseen;
    return std::filesystem::equivalent(file, out, unseen);
  };
  if (std::ranges::none_of(inputs.files, is_output, &Inputs::File::path) &&
      std::ranges::none_of(paths,
                           [&](const auto& path) { return is_output(path / part_file_name); }))
    return {};
  return fail({.code = Errc::invalid_argument,
               .where = out.string(),
               .what = "output would replace a file of a part",
               .hint = "Choose another name"});
}

Result<Source> open_source(const Inputs::File& file) {
  auto reader = DatasetReader::open(file.path);
  if (!reader) return pass(reader.error());
  if (!file.sha256.empty() && reader->digest().dataset_sha256 != file.sha256)
    return fail({.code = Errc::corrupt,
                 .where = file.path.string(),
                 .what = "data set is not that of the part",
                 .expected = file.sha256,
                 .got = reader->digest().dataset_sha256});
  if (Status same = reader->check_digest(); !same) return pass(same.error());
  if (!reader->listed().info.ended_early.empty())
    return fail({.code = Errc::unsupported,
                 .where = file.path.string(),
                 .what = "data set lacks slides that a live vote ended early"});
  Source out{file.path, reader->listed(), reader->digest().dataset_sha256};
  out.reader.emplace(std::move(*reader));
  return out;
}

/// The name in a rig file.
std::string rig_name(const DatasetInfo& info) {
  const auto rig = parse_json(info.rig_json);
  return rig && rig->is_object() ? rig->value("name", std::string()) : std::string();
}

/// All data sets must come from one recipe, by the same software. With several rigs, only
/// axes, rates and sensors must be the same.
Status require_same(const Source& first, const Source& other, MergeRigs rigs) {
  const DatasetInfo& a = first.listed.info;
  DatasetInfo b = other.listed.info;
  const auto differs = [&](const char* what, std::string expected, std::string got) {
    return fail({.code = Errc::invalid_argument,
                 .where = other.file.string(),
                 .what = std::string(what) + " differs from that of " + first.file.string(),
                 .expected = std::move(expected),
                 .got = std::move(got)});
  };
  if (a.kind != b.kind)
    return differs("bench", std::string(to_string(a.kind)), std::string(to_string(b.kind)));
  if (a.recipe_sha256 != b.recipe_sha256)
    return differs("recipe", a.name + " " + a.recipe_sha256, b.name + " " + b.recipe_sha256);
  if (a.seed != b.seed) return differs("seed", std::to_string(a.seed), std::to_string(b.seed));
  if (rigs == MergeRigs::several && !b.group_columns.empty())
    return fail({.code = Errc::unsupported,
                 .where = other.file.string(),
                 .what = "data set is merged already; its trials would lose their rigs",
                 .hint = "Name the parts that it was merged from"});
  if (rigs == MergeRigs::several) {
    b.rig_json = a.rig_json;
    b.rig_sha256 = a.rig_sha256;
    b.devices = a.devices;
  }
  if (a.rig_sha256 != b.rig_sha256) return differs("rig", a.rig_sha256, b.rig_sha256);
  if (a.software_version != b.software_version)
    return differs("Weft version", a.software_version, b.software_version);
  if (a == b) return {};
  return differs("description of devices or rates", "the same", "another");
}

Result<recipes::Plan> plan_of(const DatasetInfo& info, const std::filesystem::path& file) {
  if (info.recipe_json.empty())
    return fail({.code = Errc::unsupported,
                 .where = file.string(),
                 .what = "data set has no recipe, so its trials have no order to merge in",
                 .expected = "data set of a campaign",
                 .got = info.source});
  const auto limits = recipes::parse_rig_limits(info.rig_json);
  if (!limits) return pass(limits.error(), file.string() + ": rig");
  recipes::CheckReport report = recipes::check_recipe(info.recipe_json, *limits, info.seed);
  if (report.plan) return std::move(*report.plan);
  return fail({.code = Errc::unsupported,
               .where = file.string(),
               .what = "recipe of the data set no longer passes its check",
               .got = report.problems.empty() ? "" : recipes::to_string(report.problems.front()),
               .hint = "Merge with the Weft version that made the parts"});
}

/// Where a trial of the plan is found.
struct Place {
  std::size_t source = 0, trial = 0;
};

using TrialKey = std::tuple<std::string, std::string, std::uint32_t>;  ///< fabric, exploration,
                                                                       ///< repetition

/// The places of each trial, by the name of the rig; "" if all come from one rig.
using FoundTrials = std::map<TrialKey, std::map<std::string, Place>>;

/// `names`: of the rig of each source; empty if all come from one rig.
Result<FoundTrials> collect_trials(const std::vector<Source>& sources,
                                   const std::vector<std::string>& names) {
  FoundTrials found;
  for (std::size_t s = 0; s < sources.size(); ++s) {
    const Dataset& listed = sources[s].listed;
    for (std::size_t i = 0; i < listed.records.size(); ++i) {
      const TrialSpec& spec = listed.records[i].spec;
      const auto [before, is_new] =
          found[TrialKey{spec.label, spec.exploration, spec.repetition}].emplace(
              names.empty() ? "" : names[s], Place{s, i});
      if (!is_new)
        return tl::unexpected<Error>(given_twice(
            "fabric " + spec.label, sources[before->second.source].file, sources[s].file));
    }
  }
  return found;
}

/// The places of the trials of the plan, in its order; of one trial in the order of the rigs'
/// names. Each rig must have every trial of its fabrics, and some rig each fabric.
Result<std::vector<Place>> find_trials(const recipes::Plan& plan,
                                       const std::vector<Source>& sources,
                                       const std::vector<std::string>& names) {
  const auto found = collect_trials(sources, names);
  if (!found) return pass(found.error());
  std::map<std::string, std::set<std::string>> rigs_of;  // fabric
  std::size_t given = 0;
  for (const auto& [key, places] : *found) {
    given += places.size();
    for (const auto& [rig, place] : places) rigs_of[std::get<0>(key)].insert(rig);
  }
  std::vector<Place> out;
  std::map<std::string, std::size_t> missing;  // trials by fabric
  for (const recipes::TrialSpec& trial : plan.trials) {
    const std::string& fabric = plan.fabrics[trial.fabric];
    const auto places =
        found->find({fabric, plan.explorations[trial.exploration].name, trial.repetition});
    const auto rigs = rigs_of.find(fabric);
    if (rigs == rigs_of.end()) {
      ++missing[fabric];
      continue;
    }
    for (const std::string& rig : rigs->second)
      if (places != found->end() && places->second.contains(rig))
        out.push_back(places->second.at(rig));
      else
        ++missing[rig.empty() ? fabric : fabric + " of rig " + rig];
  }
  if (missing.empty() && out.size() == given) return out;
  if (missing.empty())
    return fail({.code = Errc::invalid_argument,
                 .what = "trials that the recipe does not plan",
                 .expected = std::to_string(out.size()) + " trials",
                 .got = std::to_string(given)});
  std::string lost;
  std::size_t planned = out.size();
  for (const auto& [fabric, trials] : missing) {
    planned += trials;
    lost += (lost.empty() ? "fabric " : ", fabric ") + fabric + " (" + std::to_string(trials) +
            " trials)";
  }
  return fail({.code = Errc::not_found,
               .where = lost,
               .what = "trials missing",
               .expected = std::to_string(planned) + " trials",
               .got = std::to_string(out.size()),
               .hint = "Add the data sets of these fabrics"});
}

}  // namespace

Result<MergedDataset> merge_parts(const std::vector<std::filesystem::path>& inputs,
                                  const std::filesystem::path& out, MergeRigs rigs,
                                  const StopRequested& stop_requested) {
  const auto found = find_inputs(inputs, rigs);
  if (!found) return pass(found.error());
  if (Status kept = keep_inputs(inputs, *found, out); !kept) return pass(kept.error());
  Sources sources;
  for (const Inputs::File& file : found->files) {
    auto source = open_source(file);
    if (!source) return pass(source.error());
    sources.add(std::move(*source));
    if (Status same = require_same(sources.all().front(), sources.all().back(), rigs); !same)
      return pass(same.error());
  }
  const DatasetInfo info = sources.all().front().listed.info;
  const auto plan = plan_of(info, sources.all().front().file);
  if (!plan) return pass(plan.error());
  DatasetInfo merged = info;
  std::vector<std::string> names;
  if (rigs == MergeRigs::several) {
    merged.group_columns = {"rig"};
    for (const Source& source : sources.all()) names.push_back(rig_name(source.listed.info));
  }
  const auto places = find_trials(*plan, sources.all(), names);
  if (!places) return pass(places.error());
  auto writer = DatasetWriter::create(out, merged);
  if (!writer) return pass(writer.error());
  for (std::size_t i = 0; i < places->size(); ++i) {
    if (stop_requested && stop_requested()) return pass(stopped_early(out.string()));
    const Place& place = (*places)[i];
    auto one = sources.load(place.source, place.trial);
    if (!one) return pass(one.error());
    one->record.spec.index = static_cast<std::uint32_t>(i);
    one->trial.file = trial_name(one->record.spec);
    if (!names.empty()) one->record.spec.group_values = {names[place.source]};
    if (const auto added = writer->add(one->trial, one->record); !added) return pass(added.error());
  }
  const auto digest = writer->finish({});
  if (!digest) return pass(digest.error());
  return MergedDataset{merged, digest->dataset_sha256, places->size(), sources.all().size()};
}

}  // namespace weft::daemon
