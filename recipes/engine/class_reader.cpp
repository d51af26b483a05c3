#include "recipes/engine/class_reader.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace weft::recipes {
namespace {

using nlohmann::json;

void read_class(const std::string& name, const json& members, const std::string& place,
                const std::vector<std::string>& fabrics, std::vector<std::string>& class_of,
                Problems& problems) {
  if (!is_name(name))
    problems.add({place, "not the name of a class", "1 to 64 letters, digits, '_', '-' or '.'",
                  brief(name), ""});
  if (!members.is_array() || members.empty())
    return problems.add({place, "not the fabrics of a class", "a list of the recipe's fabrics",
                         brief(members), ""});
  for (std::size_t i = 0; i < members.size(); ++i) {
    const auto found = members[i].is_string()
                           ? std::ranges::find(fabrics, members[i].get<std::string>())
                           : fabrics.end();
    if (found == fabrics.end()) {
      problems.add({child(place, i), "the recipe has no such fabric", "one of /fabrics",
                    brief(members[i]), ""});
      continue;
    }
    std::string& its_class = class_of[static_cast<std::size_t>(found - fabrics.begin())];
    if (!its_class.empty())
      problems.add({child(place, i), "the fabric has a class already", "each fabric once",
                    *found + " in " + its_class, ""});
    its_class = name;
  }
}

}  // namespace

std::vector<std::string> read_classes(ObjectReader& recipe, const std::vector<std::string>& fabrics,
                                      Problems& problems) {
  const json* classes = recipe.object("classes", Need::optional);
  if (classes == nullptr) return {};
  const std::string place = recipe.at("classes");
  if (classes->size() < 2)
    problems.add({place, "there is nothing to tell apart", "at least 2 classes",
                  std::to_string(classes->size()), ""});
  std::vector<std::string> class_of(fabrics.size());
  for (const auto& [name, members] : classes->items())
    read_class(name, members, child(place, name), fabrics, class_of, problems);
  for (std::size_t i = 0; i < fabrics.size(); ++i)
    if (class_of[i].empty())
      problems.add({place, "a fabric is in no class", "each fabric once", fabrics[i], ""});
  return class_of;
}

}  // namespace weft::recipes
