#include "daemon/service/methods/helpers.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "recipes/schema/diagnostic.hpp"

namespace weft::daemon::api {
namespace {

using nlohmann::json;

class Difference {
 public:
  explicit Difference(std::size_t most) : most_(most) {}

  void compare(const json& was, const json& is, const std::string& where) {
    if (was.is_object() && is.is_object()) return compare_objects(was, is, where);
    if (was.is_array() && is.is_array()) return compare_lists(was, is, where);
    if (was != is) add({{"where", where}, {"change", "changed"}, {"was", was}, {"is", is}});
  }

  json found = json::array();
  std::size_t all = 0;

 private:
  void compare_objects(const json& was, const json& is, const std::string& where) {
    for (const auto& [key, value] : was.items()) {
      const auto other = is.find(key);
      const std::string inner = recipes::child(where, key);
      if (other == is.end())
        removed(value, inner);
      else
        compare(value, *other, inner);
    }
    for (const auto& [key, value] : is.items())
      if (!was.contains(key)) added(value, recipes::child(where, key));
  }

  void compare_lists(const json& was, const json& is, const std::string& where) {
    const std::size_t both = std::min(was.size(), is.size());
    for (std::size_t i = 0; i < both; ++i) compare(was[i], is[i], recipes::child(where, i));
    for (std::size_t i = both; i < was.size(); ++i) removed(was[i], recipes::child(where, i));
    for (std::size_t i = both; i < is.size(); ++i) added(is[i], recipes::child(where, i));
  }

  void removed(const json& value, const std::string& where) {
    add({{"where", where}, {"change", "removed"}, {"was", value}});
  }
  void added(const json& value, const std::string& where) {
    add({{"where", where}, {"change", "added"}, {"is", value}});
  }
  void add(json one) {
    if (++all <= most_) found.push_back(std::move(one));
  }

  std::size_t most_;
};

}  // namespace

json differences(const json& was, const json& is, std::size_t most, std::size_t& all) {
  Difference difference(most);
  difference.compare(was, is, "");
  all = difference.all;
  return std::move(difference.found);
}

}  // namespace weft::daemon::api
