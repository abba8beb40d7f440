// The C interface has all that the C++ one has: this reads the public C++ headers, and holds every
// member against a table of what it is in C.

#include <algorithm>
#include <filesystem>
#include <map>
#include <ostream>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

namespace fs = std::filesystem;

/// Members of a C++ type and their names in carom.h: a field as "carom_struct.field", or a
/// function. A member that needs no name in C says why, in brackets.
struct CoveredType {
  std::string header;  // below the repository
  std::string type;
  std::map<std::string, std::string> names;
};

void PrintTo(const CoveredType& covered, std::ostream* out) {
  *out << covered.type;
}

std::vector<CoveredType> coveredTypes() {
  const std::string plugin = "plugin/include/carom/";
  const std::string audio = "audio/include/carom/audio/";
  return {
      {plugin + "sound_output.h",
       "SoundOutput",
       {{"close", "carom_destroy"},
        {"setListener", "carom_set_listener"},
        {"time", "carom_time"},
        {"pause", "carom_pause"},
        {"setTimeScale", "carom_set_time_scale"},
        {"play", "carom_play"},
        {"isPlaying", "carom_is_playing"},
        {"prepareRendering", "carom_prepare_rendering"},
        {"stop", "carom_stop"},
        {"record", "carom_record"},
        {"finishRecording", "carom_finish_recording"},
        {"recordRun", "carom_record_run"},
        {"finishRun", "carom_finish_run"},
        {"keepRun", "carom_keep_run"},
        {"saveRun", "carom_save_run"},
        {"setGain", "carom_set_gain"},
        {"setMuted", "carom_set_muted"},
        {"statistics", "carom_get_statistics"},
        {"report", "carom_report"},
        {"channelCount", "carom_channel_count"},
        {"sampleRate", "carom_sample_rate"},
        {"framesReady", "carom_frames_ready"},
        {"capture", "carom_capture"},
        {"capturedFrames", "carom_captured_frames"},
        {"takeCaptured", "carom_take_captured"},
        {"outputDelay", "carom_output_delay"},
        {"render", "carom_render"},
        {"renderInterleaved", "carom_render_interleaved"}}},
      {plugin + "event_sound.h",
       "EventSound",
       {{"create", "carom_create"},
        {"setBody", "carom_set_body"},
        {"removeBody", "carom_remove_body"},
        {"post", "carom_post"},
        {"updateContact", "carom_update_contact"},
        {"moveBody", "carom_move_body"},
        {"advanceTo", "carom_advance"}}},
      {plugin + "sound.h",
       "Sound",
       {{"attach", "carom_attach"},
        {"assign", "carom_assign_body"},
        {"unassign", "carom_unassign_body"},
        {"prepare", "carom_prepare_bodies"},
        {"setListener", "carom_set_listener"},
        {"materialOf", "carom_material_of"},
        {"onCollision", "carom_on_collision"}}},
      {plugin + "sound.h",
       "BodyMaterial",
       {{"material", "carom_material.name"},
        {"isGuessed", "carom_material_of"},
        {"density", "carom_material_of"}}},
      {plugin + "sound.h",
       "HeardCollision",
       {{"peak", "carom_collision.peaks"}, {"level", "carom_collision.levels"}}},
      {plugin + "sound.h",
       "SoundCollision",
       {{"time", "carom_collision.time"},
        {"body", "carom_collision.body"},
        {"other", "carom_collision.other"},
        {"position", "carom_collision.position"},
        {"normal", "carom_collision.normal"},
        {"impulse", "carom_collision.impulse"},
        {"approachSpeed", "carom_collision.approach_speed"},
        {"heard", "carom_collision.listener_count"},
        {"peak", "carom_collision.peak"}}},
      {plugin + "sound.h",
       "WorldSoundSettings",
       {{"restSpeed", "carom_settings.rest_speed"},
        {"radiators", "carom_settings.radiators"},
        {"recoil", "(carom::modal is C++ alone)"},
        {"metresPerUnit", "carom_settings.metres_per_unit"}}},
      {plugin + "sound.h",
       "BodySound",
       {{"material", "carom_body_sound.own_material"},
        {"modes", "carom_body_sound.modes"},
        {"texture", "carom_body_sound.texture"},
        {"textureCoordinates", "carom_body_sound.texture_coordinates"},
        {"silent", "carom_body_sound.silent"}}},
      {plugin + "sound_settings.h",
       "SoundSettings",
       {{"synth", "(its fields)"},
        {"listeners", "carom_settings.listeners"},
        {"latency", "carom_settings.latency"},
        {"clock", "carom_settings.clock"},
        {"budget", "(its fields)"},
        {"fullScale", "carom_settings.full_scale"},
        {"limiter", "carom_settings.limiter"},
        {"record", "carom_record"},
        {"play", "carom_play"},
        {"level", "carom_settings.level"},
        {"defaultListener", "carom_settings.listener_count"},
        {"defaultSynth", "carom_settings.lasting"},
        {"onMessage", "carom_settings.on_message"}}},
      {plugin + "sound_settings.h",
       "VoiceBudget",
       {{"cpuShare", "carom_settings.cpu_share"},
        {"voices", "carom_settings.voices"},
        {"buses", "carom_settings.buses"},
        {"longestContact", "carom_settings.longest_contact"},
        {"ringingBodies", "carom_settings.ringing_bodies"},
        {"slidingContacts", "carom_settings.sliding_contacts"},
        {"modes", "carom_settings.modes"}}},
      {plugin + "sound_settings.h",
       "SoundStatistics",
       {{"skipped", "carom_statistics.skipped"},
        {"silenced", "carom_statistics.silenced"},
        {"queueFaults", "carom_statistics.queue_faults"},
        {"stalls", "carom_statistics.stalls"},
        {"jumps", "carom_statistics.jumps"},
        {"voices", "carom_statistics.voices"},
        {"buses", "carom_statistics.buses"},
        {"ringing", "carom_statistics.ringing"},
        {"modes", "carom_statistics.modes"},
        {"cpuShare", "carom_statistics.cpu_share"},
        {"worstBlock", "carom_statistics.worst_block"},
        {"gainReduction", "carom_statistics.gain_reduction"},
        {"solvedShapes", "carom_statistics.solved_shapes"},
        {"shapesSolvedInStep", "carom_statistics.shapes_solved_late"},
        {"shapesPending", "carom_statistics.shapes_pending"},
        {"unsolvedBodies", "carom_statistics.unsolved_bodies"},
        {"links", "carom_statistics.links"},
        {"unsupportedContacts", "carom_statistics.unsupported_contacts"},
        {"unsolvedReason", "carom_unsolved_reason"},
        {"peak", "carom_statistics.peak"},
        {"peakSample", "carom_statistics.peak_sample"},
        {"warning", "carom_warning"},
        {"refusedBodies", "carom_statistics.refused_bodies"},
        {"unusedAssignments", "carom_statistics.unused_assignments"},
        {"posted", "carom_statistics.posted"},
        {"waiting", "carom_statistics.waiting"},
        {"recordingError", "carom_recording_error"}}},
      {audio + "synth_settings.h",
       "SynthCounters",
       {{"events", "carom_statistics.events"},
        {"rings", "carom_statistics.rings"},
        {"immovable", "carom_statistics.immovable"},
        {"inaudible", "carom_statistics.inaudible"},
        {"late", "carom_statistics.late"},
        {"undersampled", "carom_statistics.undersampled"},
        {"rejected", "carom_statistics.rejected"},
        {"slides", "carom_statistics.slides"},
        {"inaudibleSlides", "carom_statistics.inaudible_slides"},
        {"stolen", "carom_statistics.stolen"},
        {"overBudget", "carom_statistics.over_budget"},
        {"noBus", "carom_statistics.no_bus"},
        {"tooLong", "carom_statistics.too_long"},
        {"modalVoicesExhausted", "carom_statistics.modal_voices_exhausted"},
        {"slidesLeftOut", "carom_statistics.slides_left_out"},
        {"rejectedNotFinite", "carom_statistics.rejected_not_finite"},
        {"rejectedUnknownBody", "carom_statistics.rejected_unknown_body"},
        {"rejectedNoContact", "carom_statistics.rejected_no_contact"},
        {"rejectedTooLong", "carom_statistics.rejected_too_long"},
        {"heard", "carom_statistics.heard"},
        {"lost", "carom_statistics.lost"},
        {"ringsLeftOut", "carom_statistics.rings_left_out"},
        {"rejectedSlides", "carom_statistics.rejected_slides"},
        {"silencedFrames", "carom_statistics.silenced_frames"},
        {"rejectedTooFar", "carom_statistics.rejected_too_far"},
        {"slidesInBed", "carom_statistics.slides_in_bed"},
        {"maskedSlides", "carom_statistics.masked_slides"},
        {"masked", "carom_statistics.masked"}}},
      {audio + "synth_settings.h",
       "ComparisonSettings",
       {{"pulse", "carom_settings.pulse"},
        {"sampling", "carom_settings.sampling"},
        {"radiation", "carom_settings.radiation"}}},
      {audio + "synth_settings.h",
       "SynthSettings",
       {{"sampleRate", "carom_settings.sample_rate"},
        {"impulse", "carom_settings.impulse"},
        {"medium", "carom_settings.air_density"},
        {"audibleThreshold", "carom_settings.audible_threshold"},
        {"dissipative", "carom_settings.dissipative"},
        {"comparison", "(its fields)"},
        {"modalRadiation", "carom_settings.modal_radiation"},
        {"ringingContact", "carom_settings.ringing_contact"},
        {"contactLoss", "carom_settings.contact_loss"},
        {"lasting", "carom_settings.lasting"},
        {"slideVoices", "carom_settings.slide_voices"},
        {"stems", "(of a Synth alone)"},
        {"doppler", "carom_settings.doppler"},
        {"airAbsorption", "carom_settings.air_absorption"},
        {"room", "carom_settings.room"},
        {"reverb", "carom_settings.reverb"}}},
      {audio + "material.h",
       "Medium",
       {{"density", "carom_settings.air_density"},
        {"speedOfSound", "carom_settings.speed_of_sound"},
        {"temperature", "carom_settings.air_temperature"},
        {"humidity", "carom_settings.air_humidity"},
        {"pressure", "carom_settings.air_pressure"}}},
      {audio + "limiter.h",
       "LimiterSettings",
       {{"sampleRate", "(that of the sound)"},
        {"channels", "(those of the sound)"},
        {"ceiling", "carom_settings.limiter_ceiling"},
        {"lookAhead", "carom_settings.limiter_look_ahead"},
        {"release", "carom_settings.limiter_release"}}},
      {audio + "listener.h",
       "Listener",
       {{"name", "carom_listener.name"},
        {"position", "carom_listener.position"},
        {"orientation", "carom_listener.orientation"},
        {"format", "carom_listener.format"},
        {"spacing", "carom_listener.spacing"},
        {"halfAngle", "carom_listener.half_angle"},
        {"pattern", "carom_listener.pattern"},
        {"hrtf", "carom_listener.head"}}},
      {audio + "room.h",
       "Room",
       {{"reflectors", "carom_room.reflectors"}, {"order", "carom_room.order"}}},
      {audio + "room.h",
       "Reflector",
       {{"normal", "carom_reflector.normal"},
        {"offset", "carom_reflector.offset"},
        {"absorption", "carom_reflector.absorption"}}},
      {audio + "absorption.h",
       "Surface",
       {{"name", "carom_surface.name"},
        {"absorption", "carom_surface.absorption"},
        {"source", "carom_surface.source"}}},
      {audio + "room.h",
       "ReverbSettings",
       {{"volume", "carom_reverb.volume"},
        {"surface", "carom_reverb.surface"},
        {"decayTimes", "carom_reverb.decay_times"},
        {"decayTimeAt16kHz", "carom_reverb.decay_time_16khz"},
        {"includesAir", "carom_reverb.includes_air"},
        {"onset", "carom_reverb.onset"},
        {"gain", "carom_reverb.gain"},
        {"speedOfSound", "carom_reverb.speed_of_sound"},
        {"silence", "carom_reverb.silence"}}},
      {audio + "material.h",
       "Material",
       {{"name", "carom_material.name"},
        {"density", "carom_material.density"},
        {"youngsModulus", "carom_material.youngs_modulus"},
        {"poissonsRatio", "carom_material.poissons_ratio"},
        {"restitution", "carom_material.restitution"},
        {"dampingAlpha", "carom_material.damping_alpha"},
        {"dampingBeta", "carom_material.damping_beta"},
        {"roughness", "carom_material.roughness"},
        {"lossFactor", "carom_material.loss_factor"},
        {"lossExponent", "carom_material.loss_exponent"},
        {"thermal", "carom_material.thermal_expansion"}}},
      {audio + "material.h",
       "ThermalProperties",
       {{"expansion", "carom_material.thermal_expansion"},
        {"conductivity", "carom_material.thermal_conductivity"},
        {"heatCapacity", "carom_material.heat_capacity"}}},
      {audio + "material.h",
       "Roughness",
       {{"rmsHeight", "carom_roughness.rms_height"},
        {"correlationLength", "carom_roughness.correlation_length"},
        {"hurst", "carom_roughness.hurst"}}},
      {audio + "normal_map.h",
       "NormalMapSettings",
       {{"size", "carom_normal_map.picture_size"},
        {"greenIsDown", "carom_normal_map.green_is_down"},
        {"strength", "carom_normal_map.strength"}}},
      {audio + "sound_body.h",
       "SoundBody",
       {{"material", "carom_body.own_material"},
        {"mass", "carom_body.mass"},
        {"radius", "carom_body.radius"},
        {"edgeRadius", "carom_body.edge_radius"},
        {"shape", "carom_body.shape"},
        {"recoil", "(solved where there is time for it)"},
        {"inverseInertia", "carom_body.inertia"},
        {"texture", "carom_body.texture"},
        {"textureCoordinates", "carom_body.texture_coordinates"},
        {"modal", "carom_body.modes"},
        {"modalOrigin", "carom_body.modes_origin"}}},
      {audio + "impulse_event.h",
       "ImpulseEvent",
       {{"time", "carom_event.time"},
        {"body", "carom_event.body"},
        {"other", "carom_event.other"},
        {"impulse", "carom_event.impulse"},
        {"appliedImpulse", "carom_event.applied_impulse"},
        {"hasAppliedImpulse", "carom_event.has_applied_impulse"},
        {"position", "carom_event.position"},
        {"normal", "carom_event.normal"},
        {"approachSpeed", "carom_event.approach_speed"},
        {"effectiveMass", "carom_event.effective_mass"},
        {"radius", "carom_event.radius"},
        {"otherRadius", "carom_event.other_radius"},
        {"bodyPosition", "carom_event.body_position"},
        {"bodyOrientation", "carom_event.body_orientation"},
        {"bodyVelocity", "carom_event.body_velocity"},
        {"bodyAngularVelocity", "carom_event.body_angular_velocity"},
        {"hasOtherPose", "carom_event.has_other_pose"},
        {"otherPosition", "carom_event.other_position"},
        {"otherOrientation", "carom_event.other_orientation"}}},
      {audio + "contact_state.h",
       "ContactState",
       {{"time", "carom_contact.time"},
        {"duration", "carom_contact.duration"},
        {"phase", "carom_contact.phase"},
        {"body", "carom_contact.body"},
        {"other", "carom_contact.other"},
        {"normal", "carom_contact.normal"},
        {"position", "carom_contact.position"},
        {"normalLoad", "carom_contact.normal_load"},
        {"appliedImpulse", "carom_contact.applied_impulse"},
        {"radius", "carom_contact.radius"},
        {"otherRadius", "carom_contact.other_radius"},
        {"slipVelocity", "carom_contact.slip_velocity"},
        {"rollingVelocity", "carom_contact.rolling_velocity"},
        {"bodyPosition", "carom_contact.body_position"},
        {"bodyOrientation", "carom_contact.body_orientation"},
        {"bodyVelocity", "carom_contact.body_velocity"},
        {"otherPosition", "carom_contact.other_position"},
        {"otherOrientation", "carom_contact.other_orientation"},
        {"otherVelocity", "carom_contact.other_velocity"},
        {"pathStart", "carom_contact.path_start"},
        {"pathEnd", "carom_contact.path_end"},
        {"otherPathStart", "carom_contact.other_path_start"},
        {"otherPathEnd", "carom_contact.other_path_end"}}},
  };
}

/// Returns a text without comments.
std::string withoutComments(const std::string& text) {
  static const std::regex comment(R"(//[^\n]*|/\*[^*]*\*+(?:[^/*][^*]*\*+)*/)");
  return std::regex_replace(text, comment, "");
}

/// Returns what is between the braces of a struct or class of that name; "" if there is none.
std::string bodyOf(const std::string& text, const std::string& type) {
  const std::regex head(R"(\b(?:struct|class)\s+)" + type + R"(\b[^;{]*\{)");
  std::smatch found;
  if (!std::regex_search(text, found, head)) return {};
  const auto begin = static_cast<std::size_t>(found.position() + found.length());
  int depth = 1;
  for (std::size_t at = begin; at < text.size(); ++at) {
    depth += text[at] == '{' ? 1 : text[at] == '}' ? -1 : 0;
    if (depth == 0) return text.substr(begin, at - begin);
  }
  return {};
}

/// Splits the body of a type into its declarations, each up to its name: without initialiser,
/// arguments and nested braces.
class DeclarationSplitter {
 public:
  std::vector<std::string> split(const std::string& body) {
    for (const char letter : body)
      take(letter);
    return declarations_;
  }

 private:
  void take(char letter) {
    const bool isOutside = depth_ == 0;
    if (isOutside && letter == '(' && !isNamed_) isFunction_ = true;
    if (isOutside && (letter == '=' || letter == '{' || letter == '(')) isNamed_ = true;
    if (letter == '{' || letter == '(') ++depth_;
    if (letter == '}' || letter == ')') --depth_;
    const bool endsFunction = isFunction_ && depth_ == 0 && letter == '}';
    if ((isOutside && letter == ';') || endsFunction)
      begin();
    else if (!isNamed_)
      declarations_.back() += letter;
  }

  void begin() {
    declarations_.emplace_back();
    isNamed_ = false;
    isFunction_ = false;
  }

  std::vector<std::string> declarations_{1};
  int depth_ = 0;
  bool isNamed_ = false;  // the name has been read
  bool isFunction_ = false;
};

/// Returns the names of the public members of a C++ type: functions and fields, but for
/// constructors, operators and types.
std::set<std::string> membersOf(const std::string& header, const std::string& type) {
  std::string body = bodyOf(withoutComments(header), type);
  body = body.substr(0, std::min(body.find("private:"), body.find("protected:")));
  std::set<std::string> members;
  const std::regex last(R"(([A-Za-z_]\w*)\s*(\[[^\]]*\]\s*)*$)");
  const std::regex noMember(R"(\boperator\b|\busing\b|\bstatic_assert\b|\benum\b|\bstruct\b|~)");
  for (const std::string& declaration : DeclarationSplitter().split(body)) {
    std::smatch name;
    if (std::regex_search(declaration, noMember)) continue;
    if (std::regex_search(declaration, name, last) && name[1] != type) members.insert(name[1]);
  }
  return members;
}

std::string read(const std::string& file) {
  return contents(fs::path(CAROM_SOURCE_DIR) / file);
}

/// True if carom.h, without its comments, has the function or the field of the struct.
bool hasInC(const std::string& header, const std::string& name) {
  if (name.front() == '(') return true;
  const std::size_t dot = name.find('.');
  if (dot == std::string::npos)
    return std::regex_search(header, std::regex("\\b" + name + R"(\s*\()"));
  const std::string fields = bodyOf(header, name.substr(0, dot));
  return std::regex_search(fields, std::regex("\\b" + name.substr(dot + 1) + R"(\s*(\[|;))"));
}

class CApi : public testing::TestWithParam<CoveredType> {};

TEST_P(CApi, HasEveryMember) {
  const CoveredType& covered = GetParam();
  const std::string header = withoutComments(read("plugin/include/carom/carom.h"));
  const std::set<std::string> members = membersOf(read(covered.header), covered.type);
  EXPECT_FALSE(members.empty()) << covered.type << " is not in " << covered.header;
  for (const std::string& member : members) {
    const auto found = covered.names.find(member);
    if (found == covered.names.end())
      ADD_FAILURE()
          << covered.type << "::" << member
          << " is not in C: add it to plugin/include/carom/carom.h and plugin/c_api, test "
             "it in c_structs_test or c_api_test, and add its C name to the table of "
             "tests/plugin/c_api_coverage_test.cpp";
    else
      EXPECT_TRUE(hasInC(header, found->second))
          << covered.type << "::" << member << " is '" << found->second
          << "' in the table, which plugin/include/carom/carom.h does not have: add it there, or "
             "correct tests/plugin/c_api_coverage_test.cpp";
  }
  for (const auto& [member, name] : covered.names)
    EXPECT_TRUE(members.contains(member))
        << covered.type << "::" << member << " (" << name << ") is no member any more: remove it "
        << "from the table of tests/plugin/c_api_coverage_test.cpp, and from C";
}

INSTANTIATE_TEST_SUITE_P(, CApi, testing::ValuesIn(coveredTypes()),
                         [](const auto& covered) { return covered.param.type; });

TEST(CApiReader, FindsFieldsAndFunctionsAndNothingElse) {
  const std::string header = R"(
    struct Other { int hidden = 0; };
    /// A struct Sample { int commented; }
    struct Sample : Base {
      std::vector<Item> items = {first(), second()};  ///< a; b
      double numbers[3] = {1.0, 2.0, 3.0};
      int plain;
      std::array<double, kCount> coefficients{};
      Status act(int by = 0, const Other& other = {});
      static Result<Sample> make();
      Sample(Sample&&) noexcept;
      ~Sample();
      Vec3 at(double time) const { return time * speed; }
      double after = 0.0;
      bool operator==(const Sample&) const = default;
     private:
      int secret;
    };)";
  EXPECT_EQ(membersOf(header, "Sample"),
            (std::set<std::string>{"items", "plain", "coefficients", "act", "make", "at", "after",
                                   "numbers"}));
}

}  // namespace
}  // namespace carom::test
