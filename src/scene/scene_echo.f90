!> The names of a scene with their values, for result files and tables, and with their defaults, for
!> the reference.
module scene_echo
   use echo_types, only: echo_t
   use scene_groups, only: physical_t, walk_scene
   use scene_types, only: scales_t, scene_t
   use scene_walk, only: scene_walk_t
   implicit none (type, external)
   private
   public :: echo_t, echo_scene, list_names, reference_table

contains

   !> The names and values of a scene that count in it: ratios instead of physical units, defaults
   !> filled in, without the groups that it does not ask for.
   subroutine echo_scene(scene, entries)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Names and values, group by group; the last group is `scales`
      type(echo_t), allocatable, intent(out) :: entries(:)

      type(scene_walk_t) :: walk
      type(physical_t) :: physical
      type(scene_t) :: copy

      copy = scene
      if (allocated(copy%text)) deallocate (copy%text)
      call walk%start_echo()
      call walk_scene(walk, copy, physical)
      call walk_scales(walk, copy%scales)
      call walk%take_entries(entries)
   end subroutine echo_scene

   !> What turns ratios into the user's units; no file gives it.
   subroutine walk_scales(walk, scales)
      !> The walk, echoing
      type(scene_walk_t), intent(inout) :: walk
      !> The scales
      type(scales_t), intent(inout) :: scales

      call walk%open_group('scales')
      call walk%note_number('length', 'length L', scales%length)
      call walk%note_number('omega1', 'reference frequency omega1, rad per time', scales%omega1)
      call walk%note_number('bending_stiffness', 'E Ibar', scales%bending_stiffness)
      call walk%note_number('beam_mass', 'rho Abar L', scales%beam_mass)
      call walk%note_number('height_ratio', 'mean height over length', scales%height_ratio)
      call walk%note_number('displacement', 'y_c(0) - d, length; 0: not given', scales%displacement)
   end subroutine walk_scales

   !> Every name that a scene file may have; the values are the defaults.
   subroutine list_names(entries)
      !> Names and defaults, group by group
      type(echo_t), allocatable, intent(out) :: entries(:)

      type(scene_walk_t) :: walk
      type(physical_t) :: physical
      type(scene_t) :: scene

      call walk_scene(walk, scene, physical)
      call walk%take_entries(entries)
   end subroutine list_names

   !> The same as a table in Markdown, lines separated by new_line('a').
   subroutine reference_table(text)
      !> The table
      character(:), allocatable, intent(out) :: text

      type(echo_t), allocatable :: entries(:)
      integer :: i

      call list_names(entries)
      text = '| group | name | value | default | meaning |'//new_line('a')//'|---|---|---|---|---|'//new_line('a')
      do i = 1, size(entries)
         associate (entry => entries(i))
            text = text//'| `&'//entry%group//'` | `'//entry%name//'` | '//without_bars(entry%allowed)//' | ' &
               //entry%text//' | '//without_bars(entry%meaning)//' |'//new_line('a')
         end associate
      end do
   end subroutine reference_table

   !> A text for a cell of a table: bars, which would end the cell, escaped.
   pure function without_bars(text) result(cell)
      !> The text
      character(*), intent(in) :: text
      character(:), allocatable :: cell

      integer :: i

      cell = ''
      do i = 1, len(text)
         if (text(i:i) == '|') cell = cell//'\'
         cell = cell//text(i:i)
      end do
   end function without_bars

end module scene_echo
