#include "carom/modal/model_cache.h"

#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "modal/cache/model_claim.h"
#include "modal/cache/model_key.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {

using namespace modal;

namespace {

using testing::HasSubstr;

ModalModel named(const std::string& name) {
  ModalModel model;
  model.name = name;
  model.material = *findMaterial("glass");
  model.mass = 1.0;
  model.surface.vertices = {Vec3::Zero()};
  return model;
}

/// Sets or removes an environment variable, and restores it at the end.
class Environment {
 public:
  Environment(const char* name, const char* value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    if (value == nullptr)
      unsetenv(name);
    else
      setenv(name, value, 1);
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;
  ~Environment() {
    if (before_)
      setenv(name_, before_->c_str(), 1);
    else
      unsetenv(name_);
  }

 private:
  const char* name_;
  std::optional<std::string> before_;
};

TEST(ModelCache, FindsWhatWasStoredUnderItsKeyAlone) {
  const TemporaryFolder folder;
  ModelCache cache(folder / "made" / "here");
  const ModelKey key = ModelKey().add("bell");
  EXPECT_FALSE(cache.find(key));
  ASSERT_TRUE(cache.store(key, named("bell")));
  ASSERT_TRUE(cache.find(key));
  EXPECT_EQ(cache.find(key)->name, "bell");
  EXPECT_FALSE(cache.find(ModelKey().add("Bell")));
}

TEST(ModelCache, KeepsRecoilsAndFindsNoneThatIsDamaged) {
  const TemporaryFolder folder;
  ModelCache cache(folder.path());
  RigidRecoil recoil;
  recoil.radius = 0.25;
  recoil.poles = {{-0.5, 1.5}, {-1.0, 4.0}};
  recoil.terms = {{0, 3}, {4, 11}};
  recoil.residues = {{1.0F, 2.0F}, {-3.0F, 0.5F}, {0.0F, 1.0F}, {7.0F, -1.0F}};
  const ModelKey key = ModelKey().add("spoon");
  EXPECT_FALSE(cache.findRecoil(key));
  ASSERT_TRUE(cache.storeRecoil(key, recoil));
  const std::optional<RigidRecoil> found = cache.findRecoil(key);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->radius, recoil.radius);
  EXPECT_EQ(found->poles, recoil.poles);
  EXPECT_EQ(found->residues, recoil.residues);
  ASSERT_EQ(found->terms.size(), 2U);
  EXPECT_EQ(found->terms[1].motion, 4);
  EXPECT_EQ(found->terms[1].harmonic, 11);
  EXPECT_FALSE(cache.find(key)) << "a recoil is no model";

  const std::filesystem::path file = std::filesystem::directory_iterator(folder.path())->path();
  const auto size = std::filesystem::file_size(file);
  for (const std::uintmax_t cut : {size - 1, size / 2, std::uintmax_t{10}, std::uintmax_t{0}}) {
    std::filesystem::resize_file(file, cut);
    EXPECT_FALSE(cache.findRecoil(key)) << cut;
  }
  ASSERT_TRUE(cache.storeRecoil(key, recoil));
  {
    std::fstream damaged(file, std::ios::binary | std::ios::in | std::ios::out);
    damaged.seekp(20);
    damaged.put('x');
  }
  EXPECT_FALSE(cache.findRecoil(key));
}

TEST(ModelCache, OverwritesADamagedFile) {
  const TemporaryFolder folder;
  ModelCache cache(folder.path());
  const ModelKey key = ModelKey().add("bell");
  ASSERT_TRUE(cache.store(key, named("bell")));
  std::ofstream(folder / (key.text() + ".carom_modes"), std::ios::app) << "x";
  EXPECT_FALSE(cache.find(key));
  ASSERT_TRUE(cache.store(key, named("bell")));
  EXPECT_TRUE(cache.find(key));
}

TEST(ModelCache, SaysOnceThatItCannotStore) {
  const TemporaryFolder folder;
  std::ofstream(folder / "file") << "not a folder";
  ModelCache cache(folder / "file");
  const auto first = cache.store(ModelKey().add("a"), named("a"));
  ASSERT_FALSE(first);
  EXPECT_THAT(first.error().message, HasSubstr("the model is not cached: "));
  EXPECT_TRUE(cache.store(ModelKey().add("b"), named("b")));
  EXPECT_FALSE(cache.find(ModelKey().add("a")));
}

TEST(ModelCache, LivesWhereXdgSays) {
  {
    const Environment cache("XDG_CACHE_HOME", "/there");
    EXPECT_EQ(ModelCache::defaultFolder(), "/there/carom");
  }
  const Environment relative("XDG_CACHE_HOME", "not/absolute");
  {
    const Environment home("HOME", "/home/me");
    EXPECT_EQ(ModelCache::defaultFolder(), "/home/me/.cache/carom");
  }
  const Environment homeless("HOME", nullptr);
  EXPECT_EQ(ModelCache::defaultFolder(), "");
  ModelCache nowhere;
  EXPECT_FALSE(nowhere.store(ModelKey(), named("a")));
  EXPECT_FALSE(nowhere.find(ModelKey()));
}

TEST(ModelCache, WritersOfOneKeyDoNotMeet) {
  const TemporaryFolder folder;
  const ModelKey key = ModelKey().add("bell");
  std::vector<std::thread> writers;
  writers.reserve(4);
  for (int writer = 0; writer < 4; ++writer)
    writers.emplace_back([&] {
      ModelCache cache(folder.path());
      for (int time = 0; time < 20; ++time) {
        EXPECT_TRUE(cache.store(key, named("bell")));
        EXPECT_TRUE(cache.find(key));
      }
    });
  for (std::thread& writer : writers)
    writer.join();
  EXPECT_EQ(folder.entries(), 1u);
}

// The hash is from `sha256sum`, over the kind, the length in eight bytes and the text.
TEST(ModelKey, IsTheHashOfLengthAndText) {
  EXPECT_EQ(ModelKey().add("bell").text(),
            "bde26913fb8243562f224ace7cb60ad270eea8b7f28c36ba0e603d3a0dccbcf8");
}

TEST(ModelKey, TellsApartWhateverDiffers) {
  const SurfaceMesh mesh{{Vec3(1, 2, 3), Vec3(4, 5, 6), Vec3(7, 8, 9)}, {{0, 1, 2}}};
  SurfaceMesh moved = mesh;
  moved.vertices[2].z() += 1e-12;
  SurfaceMesh turned = mesh;
  turned.triangles[0] = {0, 2, 1};
  Material glass = *findMaterial("glass");
  Material damped = glass;
  damped.dampingBeta *= 2.0;
  const std::vector<std::string> keys = {ModelKey().text(),
                                         ModelKey().add("").text(),
                                         ModelKey().add("ab").add("c").text(),
                                         ModelKey().add("a").add("bc").text(),
                                         ModelKey().add(0.0).text(),
                                         ModelKey().add(-0.0).text(),
                                         ModelKey().add(std::uint64_t{1}).text(),
                                         ModelKey().add(mesh).text(),
                                         ModelKey().add(moved).text(),
                                         ModelKey().add(turned).text(),
                                         ModelKey().add(glass).text(),
                                         ModelKey().add(damped).text()};
  for (std::size_t one = 0; one < keys.size(); ++one)
    for (std::size_t other = 0; other < keys.size(); ++other)
      EXPECT_EQ(keys[one] == keys[other], one == other) << one << ' ' << other;
}

/// A key that no other test has.
ModelKey someKey() {
  ModelKey key;
  key.add("claimed");
  return key;
}

/// True if this process was the one to compute a model.
bool computesOne(const std::filesystem::path& folder) {
  ModelCache cache(folder);
  const ModelClaim claim(folder, someKey(), {});
  if (cache.find(someKey())) return false;
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // as if it took long
  (void)cache.store(someKey(), named("computed"));
  return true;
}

TEST(ModelClaim, OfSeveralProcessesOneComputes) {
  const TemporaryFolder folder;
  const int processes = 4;
  std::vector<pid_t> children;
  for (int child = 0; child < processes; ++child) {
    const pid_t process = fork();
    if (process == 0) _exit(computesOne(folder.path()) ? 1 : 0);
    children.push_back(process);
  }
  int computed = 0;
  for (const pid_t child : children) {
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status));
    computed += WEXITSTATUS(status);
  }
  EXPECT_EQ(computed, 1);
  EXPECT_EQ(folder.entries(), 1U);  // the model, and no lock
}

TEST(ModelClaim, ADeadProcessClaimsNothing) {
  const TemporaryFolder folder;
  const pid_t process = fork();
  if (process == 0) {
    const ModelClaim claim(folder.path(), someKey(), {});
    ::kill(::getpid(), SIGKILL);
  }
  waitpid(process, nullptr, 0);
  const ModelClaim claim(folder.path(), someKey(), [](std::string_view, double) { return false; });
  EXPECT_FALSE(claim.isCancelled());  // it did not wait
}

TEST(ModelClaim, WaitingCanBeCancelled) {
  const TemporaryFolder folder;
  const ModelClaim claim(folder.path(), someKey(), {});
  int asked = 0;
  const ModelClaim second(folder.path(), someKey(),
                          [&](std::string_view, double) { return ++asked < 3; });
  EXPECT_TRUE(second.isCancelled());
  EXPECT_EQ(asked, 3);
}

TEST(ModelClaim, WithoutAFolderThereIsNothingToWaitFor) {
  const ModelClaim claim({}, someKey(), {});
  const ModelClaim second({}, someKey(), [](std::string_view, double) { return false; });
  EXPECT_FALSE(second.isCancelled());
}

}  // namespace
}  // namespace carom::test
