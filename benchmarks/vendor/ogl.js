export {Renderer,Camera,Transform,Program,Mesh,Geometry,Texture,Orbit,Vec3,Mat4,Sphere,RenderTarget,Raycast} from "ogl"
