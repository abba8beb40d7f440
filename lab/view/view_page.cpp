#include "lab/view/view_page.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <span>
#include <unordered_map>
#include <utility>
#include <variant>

#include "lab/page/packed_text.h"
#include "lab/page/page_text.h"
#include "lab/view/page_sound.h"
#include <nlohmann/json.hpp>

#include "audio/io/byte_file.h"
#include "audio/io/partial_file.h"
#include "audio/run/head_code.h"
#include "scenes/live/scene_drawing.h"

namespace carom::lab {

using namespace scenes;
using namespace audio;
using nlohmann::ordered_json;

namespace {

constexpr const char* kTemplateName = "carom_view.html";
constexpr std::string_view kMark = "<!-- carom: runs -->";
constexpr std::string_view kEngine = "id=\"carom-engine\"";
constexpr int kFormat = 1;
constexpr std::size_t kAroundBlob = 80;  // bytes of a blob's element, at most
/// Samples of a head's responses: what HrtfSet keeps of KEMAR's at their rate, and room.
constexpr std::size_t kHeadSamples = 256;

/// Returns the numbers of a table as bytes that pack well: of each column in turn all lowest bytes,
/// then the next, each number as its difference in bits from the one above.
template <class Number>
std::vector<std::byte> inPlanes(std::span<const std::byte> rows, std::size_t columns) {
  const std::size_t row = columns * sizeof(Number);
  std::vector<std::byte> planes;
  planes.reserve(rows.size());
  for (std::size_t at = 0; at < row; ++at)
    for (std::size_t from = at; from < rows.size(); from += row)
      planes.push_back(from < row ? rows[from] : rows[from] ^ rows[from - row]);
  return planes;
}

}  // namespace

/// Makes the manifest and the blobs of a page.
class ViewPage::Maker {
 public:
  Maker(std::string pageTemplate, const std::string& title) : template_(std::move(pageTemplate)) {
    manifest_["format"] = kFormat;
    manifest_["version"] = CAROM_VERSION;
    manifest_["title"] = title;
    manifest_["runs"] = ordered_json::array();
  }

  Status setHead(const HrtfMeasurements& head) {
    manifest_["head"] = blob(encodedHead(head, kHeadSamples));
    return fault();
  }

  Result<bool> add(const ViewRun& view, std::uintmax_t most) {
    const std::size_t blobs = blobs_.size();
    if (Status added = addRun(view); !added) return added.error();
    if (bytes() <= most) return true;
    while (blobs_.size() > blobs) {
      blobBytes_ -= blobs_.back().size();
      blobs_.pop_back();
    }
    std::erase_if(numbers_, [blobs](const auto& known) { return known.second >= blobs; });
    manifest_["runs"].erase(manifest_["runs"].size() - 1);
    return false;
  }

  std::size_t runs() const { return manifest_["runs"].size(); }
  std::uintmax_t bytes() const {
    return template_.size() + blobBytes_ + blobs_.size() * kAroundBlob +
           jsonInScript(manifest_).size();
  }

  std::string text() const {
    std::string text = "<script type=\"application/json\" id=\"carom-page\">";
    text += jsonInScript(manifest_) + "</script>\n";
    for (std::size_t index = 0; index < blobs_.size(); ++index)
      text += "<script type=\"application/octet-stream\" id=\"carom-blob-" + std::to_string(index) +
              "\">" + blobs_[index] + "</script>\n";
    std::string page = template_;
    fillPage(page, kMark, text);
    return page;
  }

 private:
  /// Keeps bytes, and returns the number of their blob, which may be that of the same ones before.
  std::size_t blob(std::span<const std::byte> bytes) {
    Result<std::string> packed = packedText(bytes);
    if (!packed) {
      fault_ = packed.error().message;
      return 0;
    }
    const auto [first, last] = numbers_.equal_range(std::hash<std::string>()(*packed));
    for (auto known = first; known != last; ++known)
      if (blobs_[known->second] == *packed) return known->second;
    numbers_.emplace(std::hash<std::string>()(*packed), blobs_.size());
    blobBytes_ += packed->size();
    blobs_.push_back(*std::move(packed));
    return blobs_.size() - 1;
  }
  Status fault() const { return fault_.empty() ? Status(std::monostate{}) : Status(Error{fault_}); }

  Status addRun(const ViewRun& view) {
    const Result<EncodedRunParts> sound = encodedRunParts(pageSound(view.run));
    if (!sound) return Error{view.scene.name + ": " + sound.error().message};
    std::vector<DrawnBody> bodies;
    for (const HostBody& body : view.run.bodies.front().bodies) {
      DrawnBody& drawn = bodies.emplace_back(drawnBody(view.scene, body));
      const std::vector<ListenerPose>& poses = view.poses[body.id];
      drawn.moves = poses.size() > 1;
      if (!poses.empty()) drawn.pose = poses.front();
    }
    const KeepBlob keep = [this](std::span<const std::byte> bytes) { return blob(bytes); };
    run_ = sceneDrawing(view.scene, bodies, keep);
    run_["id"] = view.id;
    run_["label"] = view.label;
    run_["stepper"] = view.stepper;
    if (!view.sceneText.empty())
      addScene(view);
    else if (!view.notLive.empty())
      run_["notLive"] = view.notLive;
    run_["sound"] = {blob(sound->sound), blob(sound->portions)};
    if (const JelloShape* const jello = jelloOf(view.scene); jello && !view.pictures.empty())
      run_["jello"] = JelloOutline(*jello).drawing(view.scene, view.pictures, keep);
    addEvents(view);
    addPoses(view);
    addContacts(view);
    manifest_["runs"].push_back(std::move(run_));
    return fault();
  }

  void addScene(const ViewRun& view) {
    run_["scene"] = blob(std::as_bytes(std::span(view.sceneText)));
    if (view.held.text.empty()) return;
    ordered_json files = ordered_json::array();
    for (const HeldFile& file : view.held.files)
      files.push_back({{"name", file.name}, {"blob", blob(file.bytes)}});
    run_["held"] = {{"scene", blob(std::as_bytes(std::span(view.held.text)))}, {"files", files}};
  }

  // --- What happens ---

  template <class Number>
  void addTable(const char* name, std::size_t columns, const NumberTable& table) {
    run_[name] = {{"rows", table.bytes().size() / (columns * sizeof(Number))},
                  {"blob", blob(inPlanes<Number>(table.bytes(), columns))}};
  }

  void addEvents(const ViewRun& view) {
    NumberTable table;
    const std::vector<EventPlace> order = eventsInOrder(view.run);
    for (std::size_t row = 0; row < order.size(); ++row)
      addEventRow(view.run.portions[order[row].portion].events[order[row].event],
                  view.events.at(row), view.run.world.synth.impulse, table);
    addTable<double>("events", 14, table);
  }

  void addPoses(const ViewRun& view) {
    NumberTable table;
    for (std::size_t body = 0; body < view.poses.size(); ++body) {
      if (view.poses[body].size() < 2) continue;  // it stays where the manifest has it
      for (const ListenerPose& pose : view.poses[body])
        addPoseRow(static_cast<BodyId>(body), pose, table);
    }
    addTable<float>("poses", 9, table);
  }

  void addContacts(const ViewRun& view) {
    NumberTable table;
    for (const ContactBar& bar : view.contacts)
      for (const double number : {static_cast<double>(bar.body), static_cast<double>(bar.other),
                                  bar.begin, bar.end, bar.slides ? 1.0 : 0.0, bar.meanForce})
        table.add(number);
    addTable<double>("contacts", 6, table);
  }

  std::string template_;
  ordered_json manifest_;
  ordered_json run_;
  std::vector<std::string> blobs_;
  std::uintmax_t blobBytes_ = 0;
  std::unordered_multimap<std::size_t, std::size_t> numbers_;  // of blobs, by their hashes
  std::string fault_;
};

Result<ViewPage> ViewPage::create(const std::filesystem::path& pageTemplate,
                                  const std::string& title) {
  const Result<std::vector<std::byte>> read = readBytes(pageTemplate);
  if (!read) return Error{pageTemplate.string() + ": " + read.error().message};
  std::string text(reinterpret_cast<const char*>(read->data()), read->size());
  if (text.find(kMark) == std::string::npos)
    return Error{pageTemplate.string() + ": this is no template of Carom's page"};
  return ViewPage(std::make_unique<Maker>(std::move(text), title));
}

ViewPage::ViewPage(std::unique_ptr<Maker> maker) : maker_(std::move(maker)) {}
ViewPage::ViewPage(ViewPage&&) noexcept = default;
ViewPage& ViewPage::operator=(ViewPage&&) noexcept = default;
ViewPage::~ViewPage() = default;

Status ViewPage::setHead(const HrtfMeasurements& head) {
  return maker_->setHead(head);
}

Result<bool> ViewPage::add(const ViewRun& run, std::uintmax_t most) {
  return maker_->add(run, most);
}

std::size_t ViewPage::runs() const {
  return maker_->runs();
}

std::uintmax_t ViewPage::bytes() const {
  return maker_->bytes();
}

Result<ViewReport> ViewPage::write(const std::filesystem::path& file) const {
  const std::string text = maker_->text();
  ViewReport report;
  report.file = file;
  report.bytes = text.size();
  report.isLive = text.find(kEngine) != std::string::npos;
  if (const Status written = writeBytes(file, std::as_bytes(std::span(text))); !written)
    return Error{file.string() + ": " + written.error().message};
  return report;
}

Result<std::filesystem::path> findTemplate(const std::filesystem::path& asked,
                                           const std::vector<std::filesystem::path>& folders) {
  std::error_code ignored;
  if (!asked.empty()) {
    if (std::filesystem::is_regular_file(asked, ignored)) return asked;
    return Error{asked.string() + ": there is no such page template"};
  }
  for (const std::filesystem::path& folder : folders)
    if (std::filesystem::is_regular_file(folder / kTemplateName, ignored))
      return folder / kTemplateName;
  return Error{
      "the page's parts are not built: in a clone of Carom, 'cmake --preset web && cmake --build "
      "--preset web' makes build/web/web/carom_view.html (docs/view.md, \"Build\", says what to "
      "install for it); --template takes it from anywhere"};
}

}  // namespace carom::lab
