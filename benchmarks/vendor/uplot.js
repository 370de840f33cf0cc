export {default} from "uplot"
