!> The group of the surfaces in a results file, where the beam can meet more than the paper's one: where they are,
!> what happens at each, its measures.
module surface_groups
   use hdf5_writing, only: hdf5_group_t
   use kinds, only: wp
   use measure_list, only: measure_count, measure_table
   use measure_rows, only: write_measures_of_cases
   use number_text, only: to_text
   use response_types, only: surface_record_t
   use run_measures, only: row_of
   use scene_units, only: in_scene_units, units_t
   implicit none (type, external)
   private
   public :: write_surfaces, names_of

contains

   !> A list over the surfaces for each thing that is one number, a table over instants for each that is a history.
   subroutine write_surfaces(group, surfaces, units, tau)
      type(hdf5_group_t), intent(in) :: group
      !> In the scene's order
      type(surface_record_t), intent(in) :: surfaces(:)
      type(units_t), intent(in) :: units
      !> Sample times; histories have no place without them
      real(wp), contiguous, intent(in), optional :: tau(:)

      character(*), parameter :: along = 'surface'
      integer :: i

      call group%add(along, [(i, i=1, size(surfaces))], '1', 'surface, in the order of &stop, below before above', &
         is_scale=.true.)
      call group%attribute('flag_values', [(i, i=1, size(surfaces))], along)
      call group%attribute('flag_meanings', names_of(surfaces), along)
      call group%add('stop', surfaces%stop, '1', 'which &stop it belongs to', along)
      call group%add('side', surfaces%sign, '1', '1: below the beam, -1: above it', along)
      call group%add('position', surfaces%position, '1', 'position Lc/L', along, in_scene_units=units%length)
      call group%add('height', surfaces%height, '1', 'd, up from the unstressed beam', along, &
         in_scene_units=units%displacement)
      if (present(tau)) call write_histories(group, surfaces, tau, units)
      if (all([(allocated(surfaces(i)%measures), i=1, size(surfaces))])) call write_measures(group, surfaces, units)
   end subroutine write_surfaces

   !> Such as 'stop_1_below stop_2_above'.
   pure function names_of(surfaces) result(names)
      type(surface_record_t), intent(in) :: surfaces(:)
      character(:), allocatable :: names

      integer :: i

      names = ''
      do i = 1, size(surfaces)
         if (i > 1) names = names//' '
         names = names//'stop_'//to_text(surfaces(i)%stop)//trim(merge('_below', '_above', surfaces(i)%sign > 0))
      end do
   end function names_of

   !> Those that were asked for.
   subroutine write_histories(group, surfaces, tau, units)
      type(hdf5_group_t), intent(in) :: group
      type(surface_record_t), intent(in) :: surfaces(:)
      real(wp), contiguous, intent(in) :: tau(:)
      type(units_t), intent(in) :: units

      integer :: k, n

      n = size(surfaces)
      call group%add('tau', tau, '1', 'time tau', is_scale=.true., in_scene_units=units%time)
      if (allocated(surfaces(1)%eta)) call add('eta', [(surfaces(k)%eta, k=1, n)], &
         'displacement of the beam there from the surface, eta; with `side` the gap', units%displacement)
      if (allocated(surfaces(1)%velocity)) call add('velocity', [(surfaces(k)%velocity, k=1, n)], &
         'velocity of the beam there, d eta/d tau', units%velocity)
      if (allocated(surfaces(1)%force)) call add('force', [(surfaces(k)%force, k=1, n)], &
         'contact force Pbar, away from the surface', units%force)
      if (.not. allocated(surfaces(1)%energy)) return
      call add('energy', [(surfaces(k)%energy, k=1, n)], 'energy in the springs of the surface', units%energy)
      call add('dissipated', [(surfaces(k)%dissipated, k=1, n)], &
         'dissipated so far in the surface and at impacts on it', units%energy)

   contains

      !> One history of all surfaces.
      subroutine add(name, values, long_name, unit)
         character(*), intent(in) :: name
         !> Surface after surface
         real(wp), intent(in) :: values(:)
         character(*), intent(in) :: long_name
         !> One unit of it in the units of the scene; 0: not known
         real(wp), intent(in) :: unit

         call group%add(name, reshape(values, [size(tau), n]), '1', long_name, ['tau    ', 'surface'], &
            in_scene_units=unit)
      end subroutine add

   end subroutine write_histories

   !> Those that a surface has of its own, and its contacts.
   subroutine write_measures(group, surfaces, units)
      type(hdf5_group_t), intent(in) :: group
      !> With measures
      type(surface_record_t), intent(in) :: surfaces(:)
      type(units_t), intent(in) :: units

      character(len(measure_table%name)) :: names(measure_count)
      real(wp) :: rows(measure_count, size(surfaces))
      real(wp), allocatable :: start(:), end(:)
      integer, allocatable :: met(:)
      integer :: i, k

      names = merge(measure_table%name, '                        ', measure_table%is_of_surface)
      where (measure_table%is_of_surface .and. measure_table%run_name /= '') names = measure_table%run_name
      allocate (start(0), end(0), met(0))
      do k = 1, size(surfaces)
         associate (measures => surfaces(k)%measures)
            rows(:, k) = row_of(measures)
            start = [start, measures%contact_start]
            end = [end, measures%contact_end]
            met = [met, [(k, i=1, size(measures%contact_start))]]
         end associate
      end do
      call write_measures_of_cases(group, names, spread('1', 1, measure_count), rows, 'surface', &
         in_scene_units(measure_table%unit, units))
      call group%add('contact', [(i, i=1, size(start))], '1', 'contact that lasts, surface by surface', is_scale=.true.)
      call group%add('contact_surface', met, '1', 'its surface', 'contact')
      call group%add('contact_start', start, '1', 'its begin, tau', 'contact', in_scene_units=units%time)
      call group%add('contact_end', end, '1', 'its end or that of the run, tau', 'contact', in_scene_units=units%time)
   end subroutine write_measures

end module surface_groups
