//! `visualization_msgs/MarkerArray`: the scene for RViz.

use serde::Serialize;

use super::super::fields::{Pose, Xyz};
use super::super::scene::{Color, SceneUpdate};
use super::{Header, RosPose, RosTime};

#[derive(Serialize)]
pub(in crate::publish) struct MarkerArray {
    markers: Vec<Marker>,
}

#[derive(Serialize)]
struct Marker {
    header: Header,
    ns: String,
    id: i32,
    kind: i32,
    action: i32,
    pose: RosPose,
    scale: [f64; 3],
    color: [f32; 4],
    lifetime: RosTime,
    frame_locked: bool,
    points: Vec<[f64; 3]>,
    colors: Vec<[f32; 4]>,
    texture_resource: &'static str,
    texture: Texture,
    uv_coordinates: Vec<[f32; 2]>,
    text: String,
    mesh_resource: &'static str,
    mesh_file: MeshFile,
    mesh_use_embedded_materials: bool,
}

/// `sensor_msgs/CompressedImage`, for which a picture of lines has no use.
#[derive(Default, Serialize)]
struct Texture {
    header: Header,
    format: &'static str,
    data: Vec<u8>,
}

#[derive(Default, Serialize)]
struct MeshFile {
    filename: &'static str,
    data: Vec<u8>,
}

/// `Marker`'s types.
const SPHERE: i32 = 2;
const LINE_STRIP: i32 = 4;
const TEXT_VIEW_FACING: i32 = 9;

/// Markers know no pixels: lines and texts are as thick as on a picture of all lines that is so wide.
const PICTURE_PX: f64 = 1000.0;

impl From<SceneUpdate> for MarkerArray {
    fn from(scene: SceneUpdate) -> Self {
        let pixel_m = extent_m(&scene) / PICTURE_PX;
        let mut markers = Vec::new();
        for entity in scene.entities {
            let header = Header::new(entity.timestamp, entity.frame_id);
            let mut push = |kind, pose: Option<Pose>, scale, color: Option<Color>, points, text| {
                let Color { r, g, b, a } = color.unwrap_or_default();
                markers.push(Marker {
                    header: header.clone(),
                    ns: entity.id.clone(),
                    id: markers.len() as i32,
                    kind,
                    action: 0,
                    pose: pose.into(),
                    scale,
                    color: [r, g, b, a].map(|c| c as f32),
                    lifetime: RosTime::default(),
                    frame_locked: true,
                    points,
                    colors: Vec::new(),
                    texture_resource: "",
                    texture: Texture::default(),
                    uv_coordinates: Vec::new(),
                    text,
                    mesh_resource: "",
                    mesh_file: MeshFile::default(),
                    mesh_use_embedded_materials: false,
                });
            };
            for line in entity.lines {
                let width = [line.thickness * pixel_m, 0.0, 0.0];
                let points = line.points.into_iter().map(Into::into).collect();
                push(LINE_STRIP, line.pose, width, line.color, points, String::new());
            }
            for sphere in entity.spheres {
                let size = sphere.size.unwrap_or_default().into();
                push(SPHERE, sphere.pose, size, sphere.color, Vec::new(), String::new());
            }
            for label in entity.texts {
                let height = [0.0, 0.0, label.font_size * pixel_m];
                push(TEXT_VIEW_FACING, label.pose, height, label.color, Vec::new(), label.text);
            }
        }
        Self { markers }
    }
}

/// The diagonal of all lines, m; at least 1. They all count from one point.
fn extent_m(scene: &SceneUpdate) -> f64 {
    let points = scene.entities.iter().flat_map(|e| &e.lines).flat_map(|line| &line.points);
    let ends = points.fold(None, |ends: Option<(Xyz, Xyz)>, p| {
        let (low, high) = ends.unwrap_or((*p, *p));
        Some((
            Xyz { x: low.x.min(p.x), y: low.y.min(p.y), z: low.z.min(p.z) },
            Xyz { x: high.x.max(p.x), y: high.y.max(p.y), z: high.z.max(p.z) },
        ))
    });
    ends.map_or(1.0, |(low, high)| (high.x - low.x).hypot(high.y - low.y).hypot(high.z - low.z).max(1.0))
}
