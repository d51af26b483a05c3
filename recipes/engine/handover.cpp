#include "recipes/engine/handover.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "recipes/schema/quantities.hpp"

namespace weft::recipes {
namespace {

constexpr std::int64_t most_groups = 1000;
constexpr std::uint32_t least_trained = 2;  // trials per fabric; fewer have no spread
constexpr double longest_s = 86'400;

/// In the order of the enumeration.
const std::vector<std::string_view>& from_names() {
  static const std::vector<std::string_view> names{"taxels", "vibration", "imprints"};
  return names;
}

/// Training trials per fabric when the largest group is held out.
std::uint32_t left_to_train(std::uint32_t repetitions, std::uint32_t groups) {
  const std::uint32_t used = std::min(groups, repetitions);
  return repetitions - (repetitions + used - 1) / used;
}

}  // namespace

std::string_view to_string(HandoverSource from) {
  return from_names().at(static_cast<std::size_t>(from));
}

const std::vector<std::string_view>& handover_learners(HandoverSource from) {
  static const std::vector<std::string_view> of_taxels{
      "best", "cores-best", "cores-pvalue", "cores-pca", "cores-all", "lda", "svc", "trees"};
  static const std::vector<std::string_view> of_vibration{"best", "every"};
  static const std::vector<std::string_view> of_imprints{"every"};
  switch (from) {
    case HandoverSource::taxels:
      return of_taxels;
    case HandoverSource::vibration:
      return of_vibration;
    case HandoverSource::imprints:
      return of_imprints;
  }
  return of_taxels;
}

void check_left_to_train(const Handover& handover, const std::string& place, std::size_t fabrics,
                         std::uint32_t repetitions, Problems& problems) {
  // zero fabrics or repetitions are reported elsewhere
  if (fabrics == 1)
    problems.add({place, "too few fabrics for a handover", "at least 2 fabrics", "1", ""});
  if (repetitions > 0 && left_to_train(repetitions, handover.groups) < least_trained)
    problems.add({place, "too few training repetitions when one group is left out",
                  "at least 2 of each fabric",
                  std::to_string(left_to_train(repetitions, handover.groups)),
                  "Raise \"repetitions\" or \"groups\""});
  // One group is the test part, another one is for the choice of the learner.
  const std::uint32_t used = std::min(handover.groups, repetitions);
  if (handover.from == HandoverSource::vibration && repetitions > 0 && used < 3)
    problems.add({place, "too few groups of repetitions to choose a learner", "at least 3",
                  std::to_string(used), "Raise \"repetitions\" or \"groups\""});
}

std::optional<Handover> read_handover(ObjectReader& recipe, std::size_t fabrics,
                                      std::uint32_t repetitions, bool has_vibration,
                                      Problems& problems) {
  if (recipe.is_false("hand_over")) {
    recipe.leave("hand_over");
    return std::nullopt;
  }
  std::optional<ObjectReader> section = recipe.section("hand_over");
  if (!section) return std::nullopt;
  ObjectReader& reader = *section;
  const std::string& place = reader.pointer();
  Handover out;
  if (const auto from = reader.choice("from", from_names(), Need::optional))
    out.from = static_cast<HandoverSource>(*from);
  const auto& learners = handover_learners(out.from);
  out.learner = learners.front();
  if (const auto learner = reader.choice("learner", learners, Need::optional))
    out.learner = learners[*learner];
  out.groups = static_cast<std::uint32_t>(
      reader.integer("groups", 2, most_groups, Need::optional).value_or(out.groups));
  reader.set(out.at_most_s, quantities::at_most, {1, longest_s, {}});
  reader.finish();
  if (out.from == HandoverSource::vibration && !has_vibration)
    problems.add({place + "/from", "rig without a vibration sensor", "a device with role vibro", "",
                  "Use a rig with a vibration sensor, such as sim/rigs/vibrotactile.json"});
  if (out.from == HandoverSource::imprints) {
    if (reader.has("groups"))
      problems.add({reader.at("groups"), "groups not allowed for imprints", "no \"groups\"",
                    std::to_string(out.groups), ""});
    return out;
  }
  check_left_to_train(out, place, fabrics, repetitions, problems);
  return out;
}

std::vector<std::size_t> repetition_groups(std::uint32_t repetitions, std::uint32_t groups) {
  const std::size_t used = std::clamp<std::size_t>(groups, 1, std::max(repetitions, 1U));
  std::vector<std::size_t> out;
  for (std::size_t r = 0; r < repetitions; ++r) out.push_back(r * used / repetitions);
  return out;
}

}  // namespace weft::recipes
