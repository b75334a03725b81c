// What of ECharts the pages use; build.sh makes echarts.min.js of it.
import {use} from 'echarts/core';
import {CustomChart, LineChart, ScatterChart} from 'echarts/charts';
import {GridComponent, LegendPlainComponent, TooltipComponent} from 'echarts/components';
import {SVGRenderer} from 'echarts/renderers';
use([CustomChart, LineChart, ScatterChart, GridComponent, LegendPlainComponent, TooltipComponent, SVGRenderer]);
export {init} from 'echarts/core';
