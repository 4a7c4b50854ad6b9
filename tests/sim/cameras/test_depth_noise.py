import numpy as np
import pytest
from numpy.typing import NDArray

from regrasp.interfaces.cell import CameraSpec, FixedMount
from regrasp.interfaces.hidden_world import Errors
from regrasp.sim.cameras.depth_noise import DepthNoise, smooth_noise

REAR = CameraSpec(
    name="rear",
    width=848,
    height=480,
    rate=15,
    horizontal_fov_deg=65.0,
    depth_fov_deg=65.0,
    baseline=0.055,
    mount=FixedMount(position=(0.0, 0.0, 0.0), pitch_down_deg=0.0),
)
WRIST = REAR.model_copy(
    update={"name": "wrist", "horizontal_fov_deg": 69.4, "depth_fov_deg": 87.0, "baseline": 0.05}
)  # D435i
F_REAR = 424 / np.tan(np.deg2rad(32.5))  # pixels, of colour and depth alike
F_WRIST_DEPTH = 424 / np.tan(np.deg2rad(43.5))


def errors(subpixel: float = 0.0, scale: float = 0.0, fixed: float = 0.5) -> Errors:
    return Errors(
        camera_position=0.0,
        camera_angle_deg=0.0,
        depth_scale=scale,
        arm_tool=0.0,
        finger_noise=0.0,
        finger_backlash=0.0,
        finger_resolution=1e-4,
        finger_rate=100,
        depth_subpixel=subpixel,
        depth_fixed_share=fixed,
    )


def wall(depth: float) -> NDArray[np.float32]:
    return np.full((480, 848), depth, np.float32)


def step(near: float, far: float) -> NDArray[np.float32]:
    """A near strip, columns 400 to 499, before a far wall."""
    depth = wall(far)
    depth[:, 400:500] = near
    return depth


# Figures of knowledge: at 0.86 m and s = 0.08, D415 1.6 mm and D435i 2.7 mm; the formula gives them to the digit.
@pytest.mark.parametrize(("spec", "sigma"), [(REAR, 0.0016), (WRIST, 0.0027)])
def test_sigma_is_the_published_one(spec: CameraSpec, sigma: float) -> None:
    noise = DepthNoise(spec, errors(subpixel=0.08), seed=3)
    frames = np.stack([noise.apply(wall(0.86), n) for n in range(5)])[:, :, 60:]
    assert frames.std() == pytest.approx(sigma, rel=0.1)
    assert frames.mean() == pytest.approx(0.86, abs=2e-4)


def test_sigma_grows_with_the_square_of_depth() -> None:
    noise = DepthNoise(REAR, errors(subpixel=0.2), seed=3)
    near, far = (noise.apply(wall(z), 1)[:, 60:].std() for z in (0.7, 1.4))
    assert far / near == pytest.approx(4.0, rel=0.1)


def test_neighbours_are_correlated_over_a_few_pixels() -> None:
    frame = DepthNoise(REAR, errors(subpixel=0.2), seed=3).apply(wall(0.86), 1)[:, 60:] - np.float32(0.86)

    def correlation(lag: int, axis: int) -> float:
        first, second = np.split(frame, [frame.shape[axis] - lag], axis)[0], np.split(frame, [lag], axis)[1]
        return float((first * second).mean() / frame.var())

    for axis in (0, 1):
        assert correlation(1, axis) > 0.8
        assert correlation(4, axis) == pytest.approx(np.exp(-1), abs=0.07)
        assert abs(correlation(15, axis)) < 0.05


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9])
def test_the_fixed_share_of_the_variance_stays_from_frame_to_frame(share: float) -> None:
    noise = DepthNoise(REAR, errors(subpixel=0.2, fixed=share), seed=5)
    frames = np.stack([noise.apply(wall(0.86), n) for n in range(40)])[:, :, 60:]
    fresh = frames.var(axis=0, ddof=1).mean()
    assert 1.0 - fresh / frames.var() == pytest.approx(share, abs=0.05)
    # averaging n frames leaves the fixed part and 1/n of the fresh one: the tiles do not repeat themselves
    left = frames.mean(axis=0).var() / frames.var()
    assert left == pytest.approx(share + (1 - share) / 40, abs=0.03)


def test_pixels_far_apart_are_independent_over_frames() -> None:
    noise = DepthNoise(REAR, errors(subpixel=0.2, fixed=0.0), seed=5)
    frames = np.stack([noise.apply(wall(0.86), n)[100:400:100, 100:800:100].ravel() for n in range(400)])
    standard = (frames - frames.mean(axis=0)) / frames.std(axis=0)
    correlation = (standard.T @ standard / len(frames))[np.triu_indices(21, 1)]
    assert np.abs(correlation).max() < 5 / np.sqrt(400)
    assert correlation.std() == pytest.approx(1 / np.sqrt(400), rel=0.25)


def test_scale_is_one_draw_a_seed_within_two_sigma() -> None:
    scales = np.array([DepthNoise(REAR, errors(scale=0.015), seed).scale for seed in range(40)])
    assert scales.std() == pytest.approx(0.015 * 0.88, rel=0.3)  # a normal clipped at two sigma, less the two tails
    assert np.abs(scales - 1).max() <= 0.03 + 1e-12
    noise = DepthNoise(REAR, errors(scale=0.015), seed=4)
    for number in (1, 7):
        assert np.allclose(noise.apply(wall(1.0), number)[:, 60:], noise.scale, atol=5.1e-4)
    assert DepthNoise(WRIST, errors(scale=0.015), seed=4).scale != noise.scale


def test_depth_is_in_whole_millimetres() -> None:
    frame = DepthNoise(REAR, errors(subpixel=0.2, scale=0.015), seed=1).apply(wall(0.8), 1)
    assert frame.dtype == np.float32
    assert np.abs(frame * 1000.0 - np.rint(frame * 1000.0)).max() < 1e-4
    assert len(np.unique(frame)) > 10


@pytest.mark.parametrize(("spec", "focal"), [(REAR, F_REAR), (WRIST, F_WRIST_DEPTH)])
def test_nothing_nearer_than_the_largest_disparity_allows(spec: CameraSpec, focal: float) -> None:
    least = focal * spec.baseline / 126
    noise = DepthNoise(spec, errors(), seed=1)
    middle = np.s_[200:280, 500:600]
    assert (noise.apply(wall(least - 0.002), 1)[middle] == 0).all()
    assert (noise.apply(wall(least + 0.002), 1)[middle] > 0).all()


@pytest.mark.parametrize("depth", [0.5, 0.86, 2.0])
def test_the_left_band_that_the_right_imager_does_not_see(depth: float) -> None:
    frame = DepthNoise(REAR, errors(subpixel=0.2), seed=1).apply(wall(depth), 1)
    width = (frame == 0).sum(axis=1)
    assert np.abs(width - F_REAR * 0.055 / depth).max() <= 1
    assert (frame[:, 100:] > 0).all()


def test_a_wider_depth_imager_has_its_band_outside_the_colour_image() -> None:
    noise = DepthNoise(WRIST, errors(), seed=1)
    assert (noise.apply(wall(0.3), 1) > 0).all()
    # at 0.18 m the band reaches atan(0.05 / 0.18 - tan 43.5) in from the left, the colour image begins at 34.7 degrees
    f = 424 / np.tan(np.deg2rad(34.7))
    expected = (0.05 / 0.18 - np.tan(np.deg2rad(43.5)) + np.tan(np.deg2rad(34.7))) * f
    assert (noise.apply(wall(0.18), 1)[0] == 0).sum() == pytest.approx(expected, abs=1)


def test_shadow_beside_the_left_edge_of_what_is_near() -> None:
    near, far = 0.6, 0.9
    frame = DepthNoise(REAR, errors(), seed=1).apply(step(near, far), 1)
    expected = F_REAR * 0.055 * (1 / near - 1 / far)
    empty = (frame[:, 100:] == 0).sum(axis=1)
    assert np.abs(empty - expected).max() <= 1
    assert (frame[:, int(400 - expected) + 1 : 400] == 0).all()
    assert (frame[:, 400:] > 0).all()


def test_flying_pixels_hang_between_the_surfaces_at_edges_only() -> None:
    near, far = 0.6, 0.9
    frame = DepthNoise(REAR, errors(), seed=1).apply(step(near, far), 1)
    between = (frame > near + 0.005) & (frame < far - 0.005)
    columns = np.unique(np.nonzero(between)[1])
    assert columns.tolist() == [400, 499, 500]  # 399, left of the strip, is in its shadow
    share = between[:, columns].mean()
    assert share == pytest.approx(0.5, abs=0.06)
    values = frame[between]
    assert np.quantile(values, [0.1, 0.9]) == pytest.approx([0.63, 0.87], abs=0.02)
    other = DepthNoise(REAR, errors(), seed=1).apply(step(near, far), 2)
    assert not np.array_equal(frame, other)


def test_a_slanted_floor_neither_flies_nor_hides_itself() -> None:
    rays = (np.arange(480) - 239.5) / F_REAR
    drop = 0.4 / np.maximum(rays[300:], 1e-3)  # the camera level, 0.4 above the floor
    depth = wall(0.0)
    depth[300:] = drop[:, None]
    frame = DepthNoise(REAR, errors(), seed=1).apply(depth, 1)
    assert (frame[:300] == 0).all()
    assert np.abs(frame[300:, 100:] - depth[300:, 100:]).max() < 6e-4


def test_the_same_number_gives_the_same_image_whoever_asks_and_in_any_order() -> None:
    spec_errors = errors(subpixel=0.2, scale=0.015)
    depth = step(0.6, 0.9)
    first = DepthNoise(REAR, spec_errors, seed=9)
    forth = [first.apply(depth, n) for n in range(4)]
    second = DepthNoise(REAR, spec_errors, seed=9)
    back = [second.apply(depth, n) for n in reversed(range(4))][::-1]
    for a, b in zip(forth, back, strict=True):
        assert np.array_equal(a, b)
    assert not np.array_equal(forth[0], forth[1])
    assert not np.array_equal(forth[0], DepthNoise(REAR, spec_errors, seed=10).apply(depth, 0))
    assert not np.array_equal(forth[0], DepthNoise(WRIST, spec_errors, seed=9).apply(depth, 0))


def test_the_exact_image_is_left_as_it_was() -> None:
    depth = step(0.6, 0.9)
    kept = depth.copy()
    DepthNoise(REAR, errors(subpixel=0.2), seed=9).apply(depth, 1)
    assert np.array_equal(depth, kept)


def test_smooth_noise_has_unit_variance_and_joins_at_its_edges() -> None:
    field = smooth_noise((256, 512), np.random.default_rng(2), 2.0)
    assert field.std() == pytest.approx(1.0, abs=1e-3)
    inner = np.abs(np.diff(field, axis=1)).mean()
    assert np.abs(field[:, 0] - field[:, -1]).mean() == pytest.approx(inner, rel=0.2)
