// What other scripts of the page put on its window. None of them brings types.

interface Window {
  dash_clientside: any;
  dash_component_api: any;
  dashAgGridFunctions: any;
  dashAgGridComponentFunctions: any;
  React: any;
  Plotly: any;
}
